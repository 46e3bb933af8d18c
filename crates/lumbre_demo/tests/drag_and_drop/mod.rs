//! The source side of drag and drop on X11: simulates a program, such as a file manager, that drops a file on
//! a window (freedesktop's XDND protocol, version 5).

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use x11rb::COPY_DEPTH_FROM_PARENT;
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, Window, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// Far more time than a window needs to open and to answer.
const PATIENCE: Duration = Duration::from_secs(120);
/// Interval of polling: the server does not report new windows.
const PAUSE: Duration = Duration::from_millis(20);
const VERSION: u32 = 5;

/// Drops a file on the first window of a display that accepts files, and returns when the window has accepted
/// it.
pub fn drop_file(display: &str, file: &Path) -> anyhow::Result<()> {
    let dragging = Dragging::begin(display)?;
    let target = dragging.wait_for_a_window()?;
    dragging.enter(target)?;
    dragging.move_over(target)?;
    // While the pointer is over the window, it may request the data, and it answers whether it accepts them.
    dragging.serve_until(dragging.atoms.status, file)?;
    dragging.let_go(target)?;
    dragging.serve_until(dragging.atoms.finished, file)
}

struct Atoms {
    aware: Atom,
    selection: Atom,
    enter: Atom,
    position: Atom,
    status: Atom,
    drop: Atom,
    finished: Atom,
    copy: Atom,
    uri_list: Atom,
}

struct Dragging {
    server: RustConnection,
    root: Window,
    source: Window,
    atoms: Atoms,
}

impl Dragging {
    fn begin(display: &str) -> anyhow::Result<Self> {
        let (server, screen) = x11rb::connect(Some(display))?;
        let root = server.setup().roots[screen].root;
        let atom = |name: &str| anyhow::Ok(server.intern_atom(false, name.as_bytes())?.reply()?.atom);
        let atoms = Atoms {
            aware: atom("XdndAware")?,
            selection: atom("XdndSelection")?,
            enter: atom("XdndEnter")?,
            position: atom("XdndPosition")?,
            status: atom("XdndStatus")?,
            drop: atom("XdndDrop")?,
            finished: atom("XdndFinished")?,
            copy: atom("XdndActionCopy")?,
            uri_list: atom("text/uri-list")?,
        };
        let source = server.generate_id()?;
        server.create_window(
            COPY_DEPTH_FROM_PARENT,
            source,
            root,
            0,
            0,
            1,
            1,
            0,
            WindowClass::INPUT_OUTPUT,
            0,
            &CreateWindowAux::new(),
        )?;
        server.set_selection_owner(source, atoms.selection, x11rb::CURRENT_TIME)?;
        server.flush()?;
        Ok(Self { server, root, source, atoms })
    }

    fn wait_for_a_window(&self) -> anyhow::Result<Window> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            for window in self.server.query_tree(self.root)?.reply()?.children {
                let aware = self.server.get_property(false, window, self.atoms.aware, AtomEnum::ANY, 0, 1)?;
                // The window may disappear between the two requests.
                if aware.reply().is_ok_and(|property| property.value_len > 0) {
                    return Ok(window);
                }
            }
            std::thread::sleep(PAUSE);
        }
        bail!("no window takes files")
    }

    fn enter(&self, target: Window) -> anyhow::Result<()> {
        self.send(target, self.atoms.enter, [self.source, VERSION << 24, self.atoms.uri_list, 0, 0])
    }

    fn move_over(&self, target: Window) -> anyhow::Result<()> {
        let (x, y) = (40, 40);
        self.send(
            target,
            self.atoms.position,
            [self.source, 0, x << 16 | y, x11rb::CURRENT_TIME, self.atoms.copy],
        )
    }

    fn let_go(&self, target: Window) -> anyhow::Result<()> {
        self.send(target, self.atoms.drop, [self.source, 0, x11rb::CURRENT_TIME, 0, 0])
    }

    fn send(&self, target: Window, kind: Atom, data: [u32; 5]) -> anyhow::Result<()> {
        let message = ClientMessageEvent::new(32, target, kind, data);
        self.server.send_event(false, target, EventMask::NO_EVENT, message)?.check()?;
        Ok(())
    }

    /// Sends the file's URI whenever it is requested, until the window sends the message `answer` and
    /// accepts.
    fn serve_until(&self, answer: Atom, file: &Path) -> anyhow::Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            match self.server.poll_for_event()? {
                Some(Event::SelectionRequest(request)) => self.hand_out(&request, file)?,
                Some(Event::ClientMessage(message)) if message.type_ == answer => {
                    ensure!(message.data.as_data32()[1] & 1 == 1, "the window refuses the file");
                    return Ok(());
                }
                Some(_) => {}
                None => std::thread::sleep(PAUSE),
            }
        }
        bail!("the window does not answer")
    }

    fn hand_out(&self, request: &SelectionRequestEvent, file: &Path) -> anyhow::Result<()> {
        let address = format!("file://{}\r\n", percent_encoded(file.to_str().context("a path in UTF-8")?));
        self.server.change_property8(
            PropMode::REPLACE,
            request.requestor,
            request.property,
            self.atoms.uri_list,
            address.as_bytes(),
        )?;
        let notice = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: request.time,
            requestor: request.requestor,
            selection: request.selection,
            target: request.target,
            property: request.property,
        };
        self.server.send_event(false, request.requestor, EventMask::NO_EVENT, notice)?.check()?;
        Ok(())
    }
}

/// Encodes a path for a URI: special characters become `%20` and the like.
fn percent_encoded(path: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte);
    path.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}
