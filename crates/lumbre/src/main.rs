//! The `lumbre` program: reads the command line, runs one command, and turns its outcome into an exit status.

mod arguments;
mod bake;
mod bake_record;
mod compare;
mod cost;
mod explain;
mod interruption;
mod kept_samples;
mod lightmap_report;
mod loading;
mod output;
mod picture_files;
mod play;
mod progress;
mod render;
#[cfg(test)]
mod report_commands;
mod trace;
mod tune;
mod warnings;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::Parser;
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use crate::arguments::{Arguments, Command};

fn main() -> ExitCode {
    silence_device_selection();
    // Bad usage exits here, with status 2.
    let arguments = Arguments::parse();
    let messages = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time();
    tracing_subscriber::registry().with(messages_shown(&arguments)).with(messages).init();
    let outcome = match arguments.command {
        None => play::run(&arguments.play),
        Some(Command::Play(options)) => play::run(&options),
        Some(Command::Bake(options)) => bake::run(&options),
        Some(Command::Render(options)) => render::run(&options),
        Some(Command::Trace(options)) => trace::run(&options),
        Some(Command::Compare(options)) => compare::run(&options),
        Some(Command::Explain(options)) => explain::run(&options),
        Some(Command::Cost(options)) => cost::run(&options),
        Some(Command::Tune(options)) => tune::run(&options),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of the output has closed it early, as `head` does; that is no error.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lumbre: {}", message_of(&error));
            ExitCode::FAILURE
        }
    }
}

/// Returns the filter of log messages: `LUMBRE_LOG` (`debug`, or `lumbre_bake=debug,wgpu_core=info`), or else
/// warnings and the progress of bakes. `lumbre cost` runs many bakes and shows only their warnings.
fn messages_shown(arguments: &Arguments) -> Targets {
    let of_bakes =
        if matches!(arguments.command, Some(Command::Cost(_))) { Level::WARN } else { Level::INFO };
    let stated = std::env::var("LUMBRE_LOG").ok().and_then(|stated| stated.parse().ok());
    stated.unwrap_or_else(|| {
        Targets::new()
            .with_default(Level::WARN)
            .with_target("lumbre_bake", of_bakes)
            .with_targets(["wgpu_hal", "wgpu_core"].map(|noisy| (noisy, Level::ERROR)))
    })
}

/// Returns an error's text, followed by those of its causes that it does not contain already: many errors of the
/// libraries end with the text of their cause.
fn message_of(error: &anyhow::Error) -> String {
    let mut message = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !message.contains(&cause) {
            message.push_str(": ");
            message.push_str(&cause);
        }
    }
    message
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let mut causes = error.chain().filter_map(|cause| cause.downcast_ref::<std::io::Error>());
    causes.any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Without a desktop's runtime folder, Mesa's layer that asks the desktop for the preferred device makes the
/// Wayland library print an error on standard error each time a device is opened. This disables that layer.
#[allow(unsafe_code, reason = "changing the environment is unsafe where other threads may read it")]
fn silence_device_selection() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() && std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: this is the first thing that `main` does; there is no other thread yet.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

#[cfg(test)]
mod tests {
    use anyhow::{Context, anyhow};

    use super::message_of;

    #[test]
    fn a_message_says_every_cause_once() {
        let error = anyhow!("the disk is full");
        assert_eq!(message_of(&error), "the disk is full");
        let error = error.context("a.glb cannot be written: the disk is full; make room");
        assert_eq!(message_of(&error), "a.glb cannot be written: the disk is full; make room");
        let error = Err::<(), _>(error).context("the bake is lost").unwrap_err();
        assert_eq!(
            message_of(&error),
            "the bake is lost: a.glb cannot be written: the disk is full; make room"
        );
    }
}
