//! Reads back the counts of lights that passes make while they draw, in frames that are measured with
//! [`Measure::Lights`](crate::Measure). The counting itself is in `shaders/light_counts.wesl`.

use lumbre_graph::{MapRequest, MapState};

use crate::Gpu;
use crate::accounting::LightCount;
use crate::extract::LitPass;
use crate::g_buffer;

/// Bytes between the counts of two passes. They are bound at an offset, and 256 is a valid offset alignment
/// on every device.
const STRIDE: u64 = 256;
/// Four words per pass: tested and contributing, 64 bits each.
const WORDS: usize = 4;
/// Largest number of frames whose counts are being read back at once.
const MAX_ON_THE_WAY: usize = 4;
/// Storage buffers that a variant with every feature reads. Counting needs one more.
const OTHER_STORAGE_BUFFERS: u32 = 8;

/// The shader stages in which lights are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CountedStages {
    /// For flat and Gouraud shading.
    pub vertices: bool,
    /// For Phong shading, also in compute shaders.
    pub fragments: bool,
}

/// A pass that counts: one that draws lit surfaces, or the one that lights the G-buffer in compute shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum CountedPass {
    Drawn(LitPass),
    DeferredLighting,
}

/// Number of passes that count.
const PASSES: usize = LitPass::ALL.len() + 1;

/// The light counts of one frame, by pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PassCounts([LightCount; PASSES]);

impl CountedPass {
    fn all() -> [Self; PASSES] {
        std::array::from_fn(|index| {
            LitPass::ALL.get(index).map_or(Self::DeferredLighting, |pass| Self::Drawn(*pass))
        })
    }

    fn index(self) -> usize {
        match self {
            Self::Drawn(pass) => pass as usize,
            Self::DeferredLighting => LitPass::ALL.len(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Drawn(pass) => pass.name(),
            Self::DeferredLighting => g_buffer::COMPUTE_PASS,
        }
    }
}

/// The buffer that passes count into, and copies of it that are being read back.
#[derive(Debug, Default)]
pub(crate) struct LightCounter {
    counts: Option<wgpu::Buffer>,
    free: Vec<wgpu::Buffer>,
    on_the_way: Vec<Copied>,
}

#[derive(Debug)]
struct Copied {
    frame: u64,
    buffer: wgpu::Buffer,
    request: MapRequest,
}

impl CountedStages {
    /// Returns the stages that a device can count in, and notes on what it cannot count.
    pub fn of(gpu: &Gpu) -> (Self, Vec<String>) {
        let downlevel = gpu.adapter.get_downlevel_capabilities().flags;
        let room = gpu.device.limits().max_storage_buffers_per_shader_stage > OTHER_STORAGE_BUFFERS;
        let fragments = room && downlevel.contains(wgpu::DownlevelFlags::FRAGMENT_WRITABLE_STORAGE);
        let vertices = room && gpu.device.features().contains(wgpu::Features::VERTEX_WRITABLE_STORAGE);
        let early = gpu.device.features().contains(wgpu::Features::SHADER_EARLY_DEPTH_TEST);
        let mut notes = Vec::new();
        if !room {
            notes.push(
                "lights are not counted: counting needs one storage buffer more than the device allows in a shader stage".to_owned(),
            );
        } else if !fragments {
            notes.push(
                "lights are not counted under Phong shading: fragment shaders of this device cannot write storage buffers"
                    .to_owned(),
            );
        } else if !early {
            notes.push(
                "lights of fragments that something nearer hides are counted too: the device was made without SHADER_EARLY_DEPTH_TEST"
                    .to_owned(),
            );
        }
        if room && !vertices {
            notes.push(
                "lights are not counted under flat and Gouraud shading: the device was made without VERTEX_WRITABLE_STORAGE"
                    .to_owned(),
            );
        }
        (Self { vertices, fragments }, notes)
    }
}

impl PassCounts {
    /// Returns the counts of the pass with this name, if that pass lights surfaces.
    pub fn of(&self, pass: &str) -> Option<LightCount> {
        CountedPass::all()
            .into_iter()
            .find(|counted| counted.name() == pass)
            .map(|counted| self.0[counted.index()])
    }

    fn read(bytes: &[u8]) -> Self {
        let of = |pass: CountedPass| {
            let begin = pass.index() * STRIDE as usize;
            let words: [u64; WORDS] = std::array::from_fn(|word| {
                let at = begin + 4 * word;
                u64::from(u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
            });
            LightCount { tested: words[0] | words[1] << 32, contributing: words[2] | words[3] << 32 }
        };
        Self(CountedPass::all().map(of))
    }
}

impl LightCounter {
    /// Creates the buffer if needed, and sets all counts to 0.
    pub fn begin(&mut self, gpu: &Gpu) {
        let counts = self.counts.get_or_insert_with(|| {
            let usage =
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            buffer(gpu, "light counts", usage)
        });
        gpu.queue.write_buffer(counts, 0, &[0; (STRIDE as usize) * PASSES]);
    }

    /// Returns the binding of a pass's counts; `None` before [`begin`](Self::begin).
    pub fn binding(&self, pass: CountedPass) -> Option<wgpu::BufferBinding<'_>> {
        let (offset, size) = (pass.index() as u64 * STRIDE, wgpu::BufferSize::new(4 * WORDS as u64));
        self.counts.as_ref().map(|buffer| wgpu::BufferBinding { buffer, offset, size })
    }

    /// Returns the buffer of counts and a buffer to copy it into within the frame's commands; `None` if too
    /// many copies are being read back.
    pub fn copy(&mut self, gpu: &Gpu) -> Option<[wgpu::Buffer; 2]> {
        let counts = self.counts.clone().filter(|_| self.on_the_way.len() < MAX_ON_THE_WAY)?;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let copy = self.free.pop().unwrap_or_else(|| buffer(gpu, "light counts on their way", usage));
        Some([counts, copy])
    }

    /// Requests the copy of a frame's counts to be mapped, after the frame was submitted.
    pub fn send_for(&mut self, frame: u64, copy: wgpu::Buffer) {
        let request = MapRequest::new(&copy);
        self.on_the_way.push(Copied { frame, buffer: copy, request });
    }

    /// Waits for all requested copies, after the device was polled to completion.
    pub fn wait(&self) {
        for copied in &self.on_the_way {
            if copied.request.wait() == MapState::Waiting {
                return;
            }
        }
    }

    /// Returns the counts that have arrived, each with its frame's number. The device must have been polled
    /// before, which the graph does.
    pub fn arrived(&mut self) -> Vec<(u64, PassCounts)> {
        let mut arrived = Vec::new();
        while let Some(first) = self.on_the_way.first()
            && first.request.state() != MapState::Waiting
        {
            let copied = self.on_the_way.remove(0);
            if copied.request.state() == MapState::Failed {
                continue;
            }
            if let Ok(bytes) = copied.buffer.get_mapped_range(..) {
                arrived.push((copied.frame, PassCounts::read(&bytes)));
            }
            copied.buffer.unmap();
            self.free.push(copied.buffer);
        }
        arrived
    }
}

fn buffer(gpu: &Gpu, label: &str, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let size = STRIDE * PASSES as u64;
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
    gpu.device.create_buffer(&descriptor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_64_bits_and_stand_by_their_pass() {
        let mut bytes = vec![0; PASSES * STRIDE as usize];
        bytes[STRIDE as usize..][..16]
            .copy_from_slice(&[1, 0, 0, 0, 2, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0]);
        let counts = PassCounts::read(&bytes);
        let forward = LightCount { tested: (2 << 32) + 1, contributing: 0xffff_ffff };
        assert_eq!(counts.of("forward"), Some(forward));
        assert_eq!(counts.of("lightmap"), Some(LightCount::default()));
        assert_eq!(counts.of("deferred lighting"), Some(LightCount::default()));
        assert_eq!(counts.of("display"), None);
        let last = 4 * STRIDE as usize;
        bytes[last..][..4].copy_from_slice(&[7, 0, 0, 0]);
        assert_eq!(PassCounts::read(&bytes).of("deferred lighting").map(|count| count.tested), Some(7));
    }
}
