//! A baked level as read by other software: the .glb by the `gltf` crate, the KTX2 files by the `ktx2` crate and byte
//! by byte, checked against what Bevy documents for its `Lightmap`. The readers of `lumbre_scene` are used only for
//! comparison.
//!
//! Bevy's contract (`bevy_pbr::Lightmap` and its shader): the mesh's second UV channel (`ATTRIBUTE_UV_1`, glTF's
//! TEXCOORD_1) is in [0, 1] with v = 0 at the top row; the texture is 2D, float, filterable and linear (not sRGB); the
//! radiance is texel x `lightmap_exposure` x diffuse colour, so that a texel is E/π for an exposure of 1 (if the
//! camera's exposure is 1, too).

use std::collections::HashMap;
use std::path::Path;

use crate::common;
use bevy_ecs::world::World;
use glam::{DMat4, DVec2, DVec3};
use lumbre_bake::{Bake, BakeOptions, Density, Probes, Quality};
use lumbre_scene::{LightmapEncoding, PackedFormat, SaveOptions, Supercompression, load, save_with};

/// A texture as Bevy would upload it.
struct Texture {
    width: usize,
    height: usize,
    texels: Vec<DVec3>,
}

impl Texture {
    /// Reads the header with the `ktx2` crate, and decodes the texels as the Vulkan specification defines their
    /// formats.
    fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the KTX2 image lies beside the level");
        let reader = ktx2::Reader::new(&bytes[..]).expect("Bevy's reader takes it");
        let header = reader.header();
        // Bevy treats an image without depth, layers and several faces as a 2D texture, but one of a single row as a 1D
        // texture.
        assert_eq!(
            (header.pixel_depth, header.layer_count, header.face_count, header.level_count),
            (0, 0, 1, 1)
        );
        assert!(header.pixel_width > 1 && header.pixel_height > 1);
        assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
        assert_eq!(reader.color_model(), Some(ktx2::ColorModel::RGBSDA));
        // The files are saved without supercompression, so that no decoder has to be trusted.
        assert_eq!(header.supercompression_scheme, None);
        let level = reader.levels().next().expect("there is a level");
        let (width, height) = (header.pixel_width as usize, header.pixel_height as usize);
        assert_eq!(level.data.len(), 4 * width * height);
        let words =
            level.data.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        let small_float = |bits: u32, mantissa: u32| {
            let (exponent, fraction) = (bits >> mantissa, bits & ((1 << mantissa) - 1));
            let fraction = f64::from(fraction) / f64::from(1 << mantissa);
            match exponent {
                0 => fraction * 2f64.powi(-14),
                _ => (1.0 + fraction) * 2f64.powi(exponent as i32 - 15),
            }
        };
        // wgpu's Rgb9e5Ufloat and Rg11b10Ufloat: both are filterable float formats on every backend.
        let texels = match header.format {
            Some(ktx2::Format::E5B9G9R9_UFLOAT_PACK32) => words
                .map(|word| {
                    let channel = |shift: u32| f64::from(word >> shift & 0x1ff);
                    DVec3::new(channel(0), channel(9), channel(18)) * 2f64.powi((word >> 27) as i32 - 24)
                })
                .collect(),
            Some(ktx2::Format::B10G11R11_UFLOAT_PACK32) => words
                .map(|word| {
                    let (red, green) = (small_float(word & 0x7ff, 6), small_float(word >> 11 & 0x7ff, 6));
                    DVec3::new(red, green, small_float(word >> 22, 5))
                })
                .collect(),
            other => panic!("{other:?} is no filterable float format that was asked for"),
        };
        Self { width, height, texels }
    }

    /// Samples the texture as a GPU does, with bilinear filtering and clamping at the border.
    fn sample(&self, uv: DVec2) -> DVec3 {
        let at = uv * DVec2::new(self.width as f64, self.height as f64) - 0.5;
        let (low, fraction) = (at.floor(), at - at.floor());
        let read = |x: f64, y: f64| {
            let column = (low.x + x).clamp(0.0, self.width as f64 - 1.0) as usize;
            let row = (low.y + y).clamp(0.0, self.height as f64 - 1.0) as usize;
            self.texels[row * self.width + column]
        };
        let (top, bottom) = (
            read(0.0, 0.0).lerp(read(1.0, 0.0), fraction.x),
            read(0.0, 1.0).lerp(read(1.0, 1.0), fraction.x),
        );
        top.lerp(bottom, fraction.y)
    }
}

/// A lightmapped triangle in world space.
struct Face {
    corners: [DVec3; 3],
    uv: [DVec2; 3],
    texture: String,
}

/// The lightmapped triangles and lightmaps that a client reads from a baked level.
struct Client {
    faces: Vec<Face>,
    textures: HashMap<String, Texture>,
}

impl Client {
    fn read(path: &Path) -> Self {
        let gltf = gltf::Gltf::open(path).expect("the gltf crate takes the level");
        assert!(gltf.extensions_used().any(|name| name == "LUMBRE_lightmap"));
        assert!(gltf.extensions_required().next().is_none(), "any viewer may open it");
        let (mut faces, mut textures) = (Vec::new(), HashMap::new());
        let scene = gltf.default_scene().expect("there is a scene");
        let mut pending: Vec<_> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
        while let Some((node, parent)) = pending.pop() {
            let local = node.transform().matrix();
            let matrix = parent * DMat4::from_cols_array_2d(&local.map(|column| column.map(f64::from)));
            pending.extend(node.children().map(|child| (child, matrix)));
            let Some(extension) = node.extension_value("LUMBRE_lightmap") else { continue };
            assert_eq!(extension["texCoord"], 1, "Bevy's UV_1");
            let name = extension["image"].as_str().expect("the image is named").replace("%20", " ");
            let name = Path::new(&name).with_extension("ktx2").to_string_lossy().into_owned();
            let image = path.with_file_name(&name);
            textures.entry(name.clone()).or_insert_with(|| Texture::read(&image));
            for primitive in node.mesh().expect("a lightmapped node has a mesh").primitives() {
                let reader = primitive.reader(|_| gltf.blob.as_deref());
                let positions: Vec<DVec3> = reader
                    .read_positions()
                    .expect("there are positions")
                    .map(|p| matrix.transform_point3(DVec3::from_array(p.map(f64::from))))
                    .collect();
                let uv: Vec<DVec2> = reader
                    .read_tex_coords(1)
                    .expect("a lightmapped mesh has TEXCOORD_1")
                    .into_f32()
                    .map(|uv| DVec2::from_array(uv.map(f64::from)))
                    .collect();
                assert_eq!(uv.len(), positions.len());
                let inside = |uv: &DVec2| uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
                assert!(uv.iter().all(inside), "Bevy packs them into 16 bits of [0, 1]");
                let indices: Vec<usize> = match reader.read_indices() {
                    Some(indices) => indices.into_u32().map(|index| index as usize).collect(),
                    None => (0..positions.len()).collect(),
                };
                faces.extend(indices.chunks_exact(3).map(|triangle| Face {
                    corners: [0, 1, 2].map(|at| positions[triangle[at]]),
                    uv: [0, 1, 2].map(|at| uv[triangle[at]]),
                    texture: name.clone(),
                }));
            }
        }
        Self { faces, textures }
    }

    /// The radiance that Bevy shows at a point of a white diffuse material with an exposure of 1.
    fn radiance(&self, position: DVec3, normal: DVec3) -> Option<DVec3> {
        self.faces.iter().find_map(|face| {
            let [a, b, c] = face.corners;
            let cross = (b - a).cross(c - a);
            let size = cross.length();
            let facing = cross / size;
            let offset = position - a;
            let u = offset.cross(c - a).dot(facing) / size;
            let v = (b - a).cross(offset).dot(facing) / size;
            let near = offset.dot(facing).abs() < 1e-3 * size.sqrt();
            let within = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            let uv = face.uv[0] + (face.uv[1] - face.uv[0]) * u + (face.uv[2] - face.uv[0]) * v;
            (near && within && facing.dot(normal) > 0.99).then(|| self.textures[&face.texture].sample(uv))
        })
    }
}

fn baked(model: &Path, density: Density, error: f64) -> World {
    let mut world = World::new();
    load(&mut world, model).unwrap_or_else(|error| panic!("{error}"));
    let options = BakeOptions {
        density,
        quality: Quality::Draft,
        error,
        probes: Probes::Never,
        ..BakeOptions::default()
    };
    Bake::new(&options).run(&mut world).expect("the scene bakes");
    world
}

fn saved(world: &mut World, path: &Path, format: PackedFormat) {
    let options = SaveOptions {
        encoding: Some(LightmapEncoding::Rgb16Float),
        ktx2: Some(format),
        supercompression: Supercompression::None,
    };
    let report = save_with(world, path, &options).expect("the folder takes it");
    assert!(report.lightmaps.iter().any(|file| file.encoding == format.name()));
    for file in &report.lightmaps {
        assert_eq!((file.error.saturated, file.error.negative), (0, 0), "{file:?}");
        // Floats of 10 bits have a relative error of at most 1/64, and of a third of that on average.
        assert!(file.error.relative_rmse < 0.02, "{file:?}");
    }
}

#[test]
fn the_cornell_box_as_bevy_finds_it() {
    let Some(model) = common::shared("models/cornell_box.glb") else { return };
    let Some(reference) = common::shared("conformance/bake") else { return };
    let points: Vec<_> = std::fs::read_dir(reference)
        .expect("the folder can be read")
        .map(|entry| entry.expect("its entries can be read").path())
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("cornell")))
        .flat_map(|path| common::read_reference(&path))
        // Not every channel of every point is known.
        .filter(|point| point.irradiance.is_finite())
        .collect();
    assert!(points.len() > 100, "there are reference points");
    let mut world = baked(&model, Density::MapSize(128), 0.01);
    let folder = tempfile::tempdir().expect("there is room for it");
    for format in PackedFormat::ALL {
        let path = folder.path().join("cornell baked.glb");
        saved(&mut world, &path, format);
        let client = Client::read(&path);
        let mut errors = Vec::new();
        let mut mean = 0.0;
        for point in &points {
            let Some(found) = client.radiance(point.position, point.normal) else { continue };
            let expected = point.irradiance / std::f64::consts::PI;
            errors.push((found - expected).abs().element_sum() / 3.0);
            mean += expected.element_sum() / 3.0;
        }
        assert!(errors.len() * 10 > points.len() * 9, "{} of {} points found", errors.len(), points.len());
        mean /= errors.len() as f64;
        errors.sort_by(f64::total_cmp);
        // Wrong units, swapped rows or swapped channels would cause a far larger error. A draft with 128 texels a side
        // is within some per cent of the converged light.
        let median = errors[errors.len() / 2] / mean;
        assert!(median < 0.03, "{format:?}: median error {median}");
    }
}

#[test]
fn the_ktx2_shows_what_the_open_exr_shows() {
    let Some(model) = common::shared("models/cornell_box.glb") else { return };
    let mut world = baked(&model, Density::MapSize(48), 0.01);
    let folder = tempfile::tempdir().expect("there is room for it");
    let path = folder.path().join("level.gltf");
    for format in PackedFormat::ALL {
        saved(&mut world, &path, format);
        let maps = |path: &Path| {
            let mut world = World::new();
            load(&mut world, path).unwrap_or_else(|error| panic!("{error}"));
            common::maps(&mut world)
        };
        let open_exr = maps(&path);
        // A level that refers to the KTX2 images instead. A frame is linear in the texels and filtering averages them,
        // so that a bound for the texels also holds for the frame.
        let text = std::fs::read_to_string(&path).expect("a .gltf is text");
        let other = path.with_file_name("other.gltf");
        std::fs::write(&other, text.replace(".exr", ".ktx2")).expect("the folder takes it");
        let packed = maps(&other);
        assert!(!open_exr.is_empty() && open_exr.len() == packed.len());
        let mut differ = 0;
        for ((_, open_exr), (name, packed)) in open_exr.iter().zip(&packed) {
            assert!(name.ends_with(".ktx2") && packed.texels.len() == open_exr.texels.len());
            let independent = Texture::read(&path.with_file_name(name));
            for ((half, texel), client) in open_exr.texels.iter().zip(&packed.texels).zip(&independent.texels)
            {
                // Both were encoded from the same floats; a half has an error of 1/2048 of a channel, or of 2^-25.
                let bound = format.largest_error(*half * 1.001)
                    + (*half / 2047.0).max(glam::Vec3::splat(2f32.powi(-25)));
                assert!((*half - *texel).abs().cmple(bound).all(), "{half} and {texel}");
                assert_eq!(texel.as_dvec3(), *client, "our reader and the client's");
                differ += u32::from(half != texel);
            }
        }
        assert!(differ > 0, "another encoding was read");
    }
}

/// Checks the bytes of a KTX2 file against its specification (version 2.0, revision 4), and the data format descriptor
/// against the Khronos Data Format Specification 1.3, without any library.
fn check_bytes(path: &Path, format: PackedFormat, width: u32, height: u32) {
    let bytes = std::fs::read(path).expect("the image lies beside the level");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize;
    assert_eq!(bytes[..12], [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', 0xBB, b'\r', b'\n', 0x1A, b'\n']);
    // VK_FORMAT_B10G11R11_UFLOAT_PACK32 = 122, VK_FORMAT_E5B9G9R9_UFLOAT_PACK32 = 123; the type size is that of a
    // 32-bit word.
    let vulkan = if format == PackedFormat::Rgb9E5 { 123 } else { 122 };
    assert_eq!([word(12), word(16)], [vulkan, 4]);
    // Width, height, depth, layers, faces, levels, supercompression.
    assert_eq!([20, 24, 28, 32, 36, 40, 44].map(word), [width, height, 0, 0, 1, 1, 0]);
    let (descriptor, length) = (word(48) as usize, word(52) as usize);
    // The index of the one level follows the header: its offset, its length in bytes, and the same length uncompressed.
    let (at, size) = (long(80), 4 * width as usize * height as usize);
    assert_eq!([long(88), long(96)], [size, size]);
    assert_eq!(at % 4, 0, "texels begin at a multiple of their size");
    assert!(at >= descriptor + length && at + size == bytes.len());
    assert_eq!(descriptor, 104, "after the level index");
    assert_eq!(word(descriptor) as usize, length, "it states its own length");
    // Khronos' basic descriptor block, version 2, with its size.
    assert_eq!([word(descriptor + 4), word(descriptor + 8)], [0, 2 | (length as u32 - 4) << 16]);
    // RGBSDA, BT.709, linear, straight alpha; texel blocks of 1 by 1; four bytes in plane 0.
    assert_eq!(bytes[descriptor + 12..descriptor + 16], [1, 1, 1, 0]);
    assert_eq!([word(descriptor + 16), word(descriptor + 20), word(descriptor + 24)], [0, 4, 0]);
    let samples: Vec<[u32; 3]> = (descriptor + 28..descriptor + length)
        .step_by(16)
        .map(|at| [word(at) & 0xffff, word(at) >> 16 & 0xff, word(at) >> 24])
        .collect();
    // The first bit, the number of bits minus one, and the channel (red, green, blue); 0x20 marks an exponent, 0x80 a
    // float.
    let expected: &[[u32; 3]] = match format {
        PackedFormat::Rgb9E5 => {
            &[[0, 8, 0], [27, 4, 0x20], [9, 8, 1], [27, 4, 0x21], [18, 8, 2], [27, 4, 0x22]]
        }
        PackedFormat::B10G11R11 => &[[0, 10, 0x80], [11, 10, 0x81], [22, 9, 0x82]],
    };
    assert_eq!(samples, expected, "{format:?}");
}

#[test]
fn the_demo_level_as_bevy_finds_it() {
    let model = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/demo.glb"));
    // This tests the files and not the light, so that few texels and a large error suffice.
    let mut world = baked(model, Density::TexelsPerMeter(1.5), 0.5);
    let ours = common::maps(&mut world);
    let folder = tempfile::tempdir().expect("there is room for it");
    for format in PackedFormat::ALL {
        let stem = format!("demo-{}", format.name());
        let path = folder.path().join(format!("{stem}.glb"));
        saved(&mut world, &path, format);
        let client = Client::read(&path);
        assert!(client.faces.len() > 10_000, "{} triangles have a lightmap", client.faces.len());
        // There is one file for each map of the bake, with its name and its light.
        assert_eq!(client.textures.len(), ours.len());
        let mut lit = 0;
        for (name, image) in &ours {
            let node = name.strip_suffix(".lightmap.exr").expect("a map is named after its node");
            let name = format!("{stem}.lightmaps/{node}.ktx2");
            check_bytes(&path.with_file_name(&name), format, image.width, image.height);
            let texture = &client.textures[&name];
            assert_eq!(
                [texture.width, texture.height],
                [image.width, image.height].map(|side| side as usize)
            );
            for (texel, found) in image.texels.iter().zip(&texture.texels) {
                let bound = format.largest_error(*texel).as_dvec3() * 1.000_001;
                assert!((texel.as_dvec3() - *found).abs().cmple(bound).all(), "{name}: {texel} is {found}");
                lit += usize::from(found.max_element() > 0.0);
            }
        }
        assert!(lit > 1000, "{lit} texels are lit");
        // By the names of the nodes, every static mesh of the level has a lightmap, and no dynamic one has.
        let read = |path: &Path| gltf::Gltf::open(path).expect("the gltf crate takes the level");
        let (plain, baked) = (read(model), read(&path));
        let mapped: Vec<&str> = baked
            .nodes()
            .filter(|node| node.extension_value("LUMBRE_lightmap").is_some())
            .filter_map(|node| node.name())
            .collect();
        let moving = |node: &gltf::Node<'_>| {
            node.extension_value("LUMBRE_object").is_some_and(|object| object["dynamic"] == true)
        };
        let (mut still, mut moves) = (0, 0);
        for node in plain.nodes().filter(|node| node.mesh().is_some()) {
            let name = node.name().expect("the level's nodes have names");
            let is_static = !moving(&node) && !under_a_moving_node(&plain, node.index(), &moving);
            assert_eq!(mapped.contains(&name), is_static, "{name}");
            still += usize::from(is_static);
            moves += usize::from(!is_static);
        }
        assert!(still > 20 && moves > 2, "{still} are static, {moves} are dynamic");
    }
}

/// Whether any ancestor of a node is dynamic.
fn under_a_moving_node(level: &gltf::Gltf, node: usize, moving: &impl Fn(&gltf::Node<'_>) -> bool) -> bool {
    let parent = level.nodes().find(|parent| parent.children().any(|child| child.index() == node));
    parent.is_some_and(|parent| moving(&parent) || under_a_moving_node(level, parent.index(), moving))
}
