//! Uploads the overlay's triangles and textures to the GPU and draws them. Its contents are in `overlay`.

use lumbre_render::Gpu;

/// Paints egui's output over a finished frame.
pub struct OverlayPainter {
    renderer: egui_wgpu::Renderer,
    triangles: Vec<egui::ClippedPrimitive>,
    screen: egui_wgpu::ScreenDescriptor,
}

impl OverlayPainter {
    /// Creates a painter for targets of one format.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let options = egui_wgpu::RendererOptions { dithering: false, ..Default::default() };
        let renderer = egui_wgpu::Renderer::new(&gpu.device, format, options);
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels: [1, 1], pixels_per_point: 1.0 };
        Self { renderer, triangles: Vec::new(), screen }
    }

    /// Uploads the overlay of one frame for a target of `size` pixels. `textures` holds what changed since
    /// the last call.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        triangles: Vec<egui::ClippedPrimitive>,
        textures: &egui::TexturesDelta,
        size: (u32, u32),
        pixels_per_point: f32,
    ) {
        for (id, deltas) in &textures.set {
            for delta in deltas {
                self.renderer.update_texture(&gpu.device, &gpu.queue, *id, delta);
            }
        }
        for id in &textures.free {
            self.renderer.free_texture(id);
        }
        self.screen =
            egui_wgpu::ScreenDescriptor { size_in_pixels: [size.0.max(1), size.1.max(1)], pixels_per_point };
        self.triangles = triangles;
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("overlay upload") });
        let more = self.renderer.update_buffers(
            &gpu.device,
            &gpu.queue,
            &mut encoder,
            &self.triangles,
            &self.screen,
        );
        gpu.queue.submit(more.into_iter().chain([encoder.finish()]));
    }

    /// Paints what was prepared last.
    pub fn paint(&self, pass: &mut wgpu::RenderPass<'static>) {
        self.renderer.render(pass, &self.triangles, &self.screen);
    }
}
