//! Checks lightmap files with independent readers: the `image` and `ktx2` crates, and a decoding of the bytes
//! by hand.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2, Vec3};
use half::f16;
use lumbre_mesh::TriangleMesh;
use lumbre_scene::*;

/// An image whose channels are independent and log-uniform in [2^-8, 2^8).
fn light(width: u32, height: u32) -> LightmapImage {
    let mut state = 0x2545_f491_4f6c_dd1du64;
    let mut channel = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 40) as f32 / (1 << 24) as f32 * 16.0 - 8.0).exp2()
    };
    let texels = (0..width * height).map(|_| Vec3::new(channel(), channel(), channel())).collect();
    let (name, encoding) = ("light.exr".to_owned(), LightmapEncoding::Rgb32Float);
    LightmapImage { name, width, height, texels, encoding }
}

fn by_the_image_crate(bytes: &[u8]) -> Vec<Vec3> {
    let image = image::load_from_memory_with_format(bytes, image::ImageFormat::OpenExr).unwrap();
    image.to_rgb32f().pixels().map(|pixel| Vec3::from_array(pixel.0)).collect()
}

/// The value of an attribute in an OpenEXR header, which stores name, type, size and value.
fn attribute<'a>(file: &'a [u8], name: &str, kind: &str) -> &'a [u8] {
    let key: Vec<u8> = [name.as_bytes(), &[0], kind.as_bytes(), &[0]].concat();
    let at = file.windows(key.len()).position(|window| window == key).unwrap() + key.len();
    let size = u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    &file[at + 4..at + 4 + size]
}

#[test]
fn open_exr_is_read_by_others() {
    let image = light(37, 21);
    for (encoding, pixel_type) in [(LightmapEncoding::Rgb16Float, 1u8), (LightmapEncoding::Rgb32Float, 2)] {
        let (bytes, error) = lightmap_to_open_exr(&image, encoding).unwrap();
        let half = encoding == LightmapEncoding::Rgb16Float;
        let expected = |texel: &Vec3| match half {
            // Round to nearest, ties to even, in integer arithmetic: a half has 13 mantissa bits fewer than a
            // float.
            true => Vec3::from_array(texel.to_array().map(|channel| {
                let bits = channel.to_bits();
                let up = (bits & 0x1fff) + (bits >> 13 & 1) > 0x1000;
                f32::from_bits((bits & !0x1fff) + (u32::from(up) << 13))
            })),
            false => *texel,
        };
        let expected: Vec<Vec3> = image.texels.iter().map(expected).collect();
        assert_eq!(by_the_image_crate(&bytes), expected);
        // Check the header: magic number, version 2 without flags, ZIP with 16 lines, channels in
        // alphabetical order.
        assert_eq!(bytes[..8], [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
        assert_eq!(attribute(&bytes, "compression", "compression"), [3]);
        assert_eq!(attribute(&bytes, "lineOrder", "lineOrder"), [0]);
        let channels = attribute(&bytes, "channels", "chlist");
        assert_eq!(channels.len(), 3 * 18 + 1);
        for (entry, name) in channels.chunks_exact(18).zip(*b"BGR") {
            assert_eq!((entry[0], entry[2]), (name, pixel_type), "{entry:?}");
            assert_eq!(entry[10..], [1, 0, 0, 0, 1, 0, 0, 0], "every texel is sampled");
        }
        let window: Vec<u8> = [0i32, 0, 36, 20].into_iter().flat_map(i32::to_le_bytes).collect();
        assert_eq!(attribute(&bytes, "dataWindow", "box2i"), window);
        assert_eq!(error.saturated, 0);
        assert_eq!(error.relative_rmse == 0.0, !half);
        assert!(error.largest <= 2f64.powi(8 - 11) / mean(&image), "{error:?}");
    }
    let bright = LightmapImage { width: 1, height: 1, texels: vec![Vec3::new(1e6, -1e6, 1.0)], ..image };
    let (bytes, error) = lightmap_to_open_exr(&bright, LightmapEncoding::Rgb16Float).unwrap();
    assert_eq!(by_the_image_crate(&bytes), [Vec3::new(65504.0, -65504.0, 1.0)]);
    assert_eq!((error.saturated, error.negative), (1, 0));
}

fn mean(image: &LightmapImage) -> f64 {
    let sum: DVec3 = image.texels.iter().map(|texel| texel.as_dvec3()).sum();
    sum.element_sum() / (3 * image.texels.len()) as f64
}

/// The header and texels of a file. The `ktx2` crate parses it, and the reference library decompresses
/// Zstandard.
fn by_the_ktx2_crate(bytes: &[u8]) -> (ktx2::Header, Vec<u32>) {
    let reader = ktx2::Reader::new(bytes).unwrap();
    let level = reader.levels().next().unwrap();
    let unpacked = match reader.header().supercompression_scheme {
        None => level.data.to_vec(),
        Some(ktx2::SupercompressionScheme::Zstandard) => {
            zstd::bulk::decompress(level.data, level.uncompressed_byte_length as usize).unwrap()
        }
        Some(other) => panic!("{other:?}"),
    };
    assert_eq!(unpacked.len() as u64, level.uncompressed_byte_length);
    let words = unpacked.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
    (reader.header(), words)
}

/// Decodes 32-bit colours by the text of the Vulkan specification, independently of the crate.
fn unpacked(format: PackedFormat, word: u32) -> Vec3 {
    match format {
        PackedFormat::Rgb9E5 => {
            let scale = 2f32.powi((word >> 27) as i32 - 15 - 9);
            Vec3::new((word & 511) as f32, (word >> 9 & 511) as f32, (word >> 18 & 511) as f32) * scale
        }
        // An unsigned float of 11 or 10 bits is a half float without the sign and the lowest bits.
        PackedFormat::B10G11R11 => Vec3::new(
            f16::from_bits((word as u16 & 0x7ff) << 4).to_f32(),
            f16::from_bits(((word >> 11) as u16 & 0x7ff) << 4).to_f32(),
            f16::from_bits(((word >> 22) as u16) << 5).to_f32(),
        ),
    }
}

#[test]
fn ktx2_is_read_by_others() {
    let image = light(64, 33);
    for format in PackedFormat::ALL {
        for scheme in [Supercompression::None, Supercompression::Zstandard] {
            let (bytes, error) = lightmap_to_ktx2(&image, format, scheme).unwrap();
            let (header, words) = by_the_ktx2_crate(&bytes);
            let expected = match format {
                PackedFormat::Rgb9E5 => ktx2::Format::E5B9G9R9_UFLOAT_PACK32,
                PackedFormat::B10G11R11 => ktx2::Format::B10G11R11_UFLOAT_PACK32,
            };
            assert_eq!(header.format, Some(expected));
            assert_eq!((header.pixel_width, header.pixel_height, header.pixel_depth), (64, 33, 0));
            assert_eq!((header.layer_count, header.face_count, header.level_count), (0, 1, 1));
            let reader = ktx2::Reader::new(&bytes[..]).unwrap();
            let (descriptor, type_size) = ktx2::dfd::Basic::from_format(expected).unwrap();
            assert_eq!(header.type_size, type_size);
            assert_eq!(reader.basic_dfd(), Some(&descriptor));
            assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
            let entries: Vec<_> = reader.key_value_data().collect();
            assert_eq!(
                entries.iter().map(|(key, _)| *key).collect::<Vec<_>>(),
                ["KTXorientation", "KTXwriter"]
            );
            assert_eq!(entries[0].1, b"rd\0");
            assert!(reader.writer().unwrap().starts_with("Lumbre "));
            let offset = reader.levels().next().unwrap().data.as_ptr() as usize - bytes.as_ptr() as usize;
            assert!(offset.is_multiple_of(4) && reader.supercompression_global_data().is_empty());

            let decoded: Vec<Vec3> = words.iter().map(|&word| unpacked(format, word)).collect();
            for (decoded, texel) in decoded.iter().zip(&image.texels) {
                let bound = format.largest_error(*texel);
                assert!((*decoded - *texel).abs().cmple(bound).all(), "{texel} became {decoded}");
            }
            let squares: f64 = decoded
                .iter()
                .zip(&image.texels)
                .map(|(decoded, texel)| (decoded.as_dvec3() - texel.as_dvec3()).length_squared())
                .sum();
            let rmse = (squares / (3 * decoded.len()) as f64).sqrt() / mean(&image);
            assert!((error.relative_rmse / rmse - 1.0).abs() < 1e-12, "{error:?} instead of {rmse}");
            let again = Ktx2Texture::from_bytes(&bytes, 64 * 33).unwrap();
            assert_eq!(again.texels, words);
            assert!(Ktx2Texture::from_bytes(&bytes, 64 * 33 - 1).is_err(), "the caller's limit holds");
        }
    }
}

/// Rounding must be unbiased: the mean signed error is within five standard errors of 0. The texels are
/// uniform in [1, 2), where each format has a constant step, so the half step rounded down at 1 balances the
/// one rounded up at 2.
#[test]
fn rounding_keeps_the_energy() {
    let mut image = light(512, 512);
    for texel in &mut image.texels {
        // log2 is uniform in [-8, 8).
        *texel = texel.map(|channel| 1.0 + (channel.log2() + 8.0) / 16.0).min(Vec3::splat(2.0 - 1e-7));
    }
    let (half, _) = lightmap_to_open_exr(&image, LightmapEncoding::Rgb16Float).unwrap();
    let packed = PackedFormat::ALL.map(|format| {
        let (bytes, _) = lightmap_to_ktx2(&image, format, Supercompression::None).unwrap();
        Ktx2Texture::from_bytes(&bytes, u64::MAX).unwrap().colors().collect::<Vec<_>>()
    });
    for decoded in packed.into_iter().chain([by_the_image_crate(&half)]) {
        let errors: Vec<f64> = decoded
            .iter()
            .zip(&image.texels)
            .flat_map(|(decoded, texel)| (decoded.as_dvec3() - texel.as_dvec3()).to_array())
            .collect();
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let deviation = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        assert!(deviation > 0.0 && mean.abs() < 5.0 * deviation / count.sqrt(), "{mean} of {deviation}");
    }
}

#[test]
fn what_does_not_fit_is_reported() {
    let texels = vec![Vec3::splat(65_000.0), Vec3::splat(70_000.0), Vec3::new(-1.0, 2.0, 3.0), Vec3::ZERO];
    let image = LightmapImage { width: 2, height: 2, texels, ..light(2, 2) };
    for (format, saturated) in [(PackedFormat::Rgb9E5, 1), (PackedFormat::B10G11R11, 2)] {
        let (bytes, error) = lightmap_to_ktx2(&image, format, Supercompression::Zstandard).unwrap();
        assert_eq!((error.saturated, error.negative), (saturated, 1), "{format:?}");
        let (_, words) = by_the_ktx2_crate(&bytes);
        assert_eq!(unpacked(format, words[1]), format.largest());
        assert_eq!(unpacked(format, words[2]).x, 0.0);
    }
    let broken =
        LightmapImage { texels: vec![Vec3::ZERO, Vec3::NAN, Vec3::ZERO, Vec3::ZERO], ..image.clone() };
    let error = lightmap_to_ktx2(&broken, PackedFormat::Rgb9E5, Supercompression::None).unwrap_err();
    assert_eq!(error, LightmapFileError::NotFinite { column: 1, row: 0 });
    let short = LightmapImage { height: 3, ..image };
    assert!(lightmap_to_open_exr(&short, LightmapEncoding::Rgb32Float).is_err());
}

/// A World with one lightmapped triangle.
fn world(image: LightmapImage) -> World {
    let mut world = World::new();
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        uv1: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        indices: vec![0, 1, 2],
        ..TriangleMesh::default()
    };
    let lightmap = Lightmap { image: Arc::new(image) };
    world.spawn((Name::new("floor"), Mesh(Arc::new(mesh)), StaticObject, lightmap));
    world
}

fn loaded_lightmap(path: &std::path::Path) -> Arc<LightmapImage> {
    let mut world = World::new();
    load(&mut world, path).unwrap_or_else(|error| panic!("{error}"));
    let mut query = world.query::<&Lightmap>();
    query.single(&world).unwrap().image.clone()
}

#[test]
fn saving_with_choices() {
    let image = light(16, 8);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.gltf");
    let options = SaveOptions {
        encoding: Some(LightmapEncoding::Rgb16Float),
        ktx2: Some(PackedFormat::B10G11R11),
        ..SaveOptions::default()
    };
    let report = save_with(&mut world(image.clone()), &path, &options).unwrap();
    let encodings: Vec<_> = report.lightmaps.iter().map(|file| file.encoding).collect();
    assert_eq!(encodings, ["rgb16f", "b10g11r11"]);
    for file in &report.lightmaps {
        assert_eq!(std::fs::metadata(&file.path).unwrap().len(), file.bytes);
        assert!(file.error.relative_rmse > 0.0 && file.error.relative_rmse < 0.02, "{file:?}");
    }
    let half = loaded_lightmap(&path);
    assert_eq!(half.encoding, LightmapEncoding::Rgb16Float);
    // A level that refers to the KTX2 image instead shows the same light.
    let text = std::fs::read_to_string(&path)
        .unwrap()
        .replace("level.lightmaps/floor.exr", "level.lightmaps/floor.ktx2");
    std::fs::write(&path, text).unwrap();
    let packed = loaded_lightmap(&path);
    assert_eq!((packed.width, packed.height), (16, 8));
    for (packed, texel) in packed.texels.iter().zip(&image.texels) {
        let bound = PackedFormat::B10G11R11.largest_error(*texel);
        assert!((*packed - *texel).abs().cmple(bound).all(), "{texel} became {packed}");
    }
}

/// Evaluates Bevy's shader (`irradiance_volume.wgsl`) at the centre of a cell: three texels of an atlas of
/// (Rx, 2 Ry, 3 Rz), in the second half of the rows where a component of the normal is negative, weighted by
/// the squares of the components.
fn as_bevy_samples(header: &ktx2::Header, words: &[u32], cell: [u32; 3], normal: Vec3) -> Vec3 {
    let (width, height, depth) = (header.pixel_width, header.pixel_height, header.pixel_depth);
    (0..3u32)
        .map(|axis| {
            let row = cell[1] + if normal[axis as usize] < 0.0 { height / 2 } else { 0 };
            let slice = cell[2] + axis * (depth / 3);
            let at = (slice * height + row) * width + cell[0];
            unpacked(PackedFormat::Rgb9E5, words[at as usize]) * normal[axis as usize].powi(2)
        })
        .sum()
}

#[test]
fn irradiance_volumes_are_laid_out_as_bevy_samples_them() {
    let resolution = glam::UVec3::new(3, 2, 4);
    let colors = light(6, 24).texels;
    let cubes: Vec<AmbientCube> =
        colors.chunks_exact(6).map(|sides| AmbientCube(sides.try_into().unwrap())).collect();
    let volume = IrradianceVolume { resolution, cubes, inside: Vec::new() };
    let (bytes, error) = volume.to_ktx2(PackedFormat::Rgb9E5, Supercompression::Zstandard).unwrap();
    assert!(error.relative_rmse > 0.0 && error.largest <= 256.0 / 511.5 / mean(&light(6, 24)), "{error:?}");
    let (header, words) = by_the_ktx2_crate(&bytes);
    assert_eq!((header.pixel_width, header.pixel_height, header.pixel_depth), (3, 4, 12));
    let again = IrradianceVolume::from_ktx2(&bytes, 6 * 24).unwrap();
    assert_eq!(again.resolution, resolution);
    for (at, cube) in again.cubes.iter().enumerate() {
        let at = at as u32;
        let cell = [at % 3, at / 3 % 2, at / 6];
        for normal in [
            Vec3::X,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::new(0.6, -0.64, 0.48),
            Vec3::new(-0.48, 0.6, -0.64),
        ] {
            let expected = as_bevy_samples(&header, &words, cell, normal);
            assert!(
                (cube.irradiance(normal) - expected).abs().max_element() <= 1e-6 * expected.max_element()
            );
        }
        let bound = cube.0.iter().zip(&volume.cubes[at as usize].0);
        for (found, original) in bound {
            assert!((*found - *original).abs().cmple(PackedFormat::Rgb9E5.largest_error(*original)).all());
        }
    }
    assert!(IrradianceVolume::from_ktx2(&bytes, 6 * 24 - 1).is_err());
    let flat = lightmap_to_ktx2(&light(4, 4), PackedFormat::Rgb9E5, Supercompression::None).unwrap().0;
    assert!(IrradianceVolume::from_ktx2(&flat, 1 << 20).is_err(), "two dimensions are no volume");
}

#[test]
fn an_irradiance_volume_comes_back_in_its_place() {
    let cubes =
        light(6, 12).texels.chunks_exact(6).map(|sides| AmbientCube(sides.try_into().unwrap())).collect();
    let inside: Vec<bool> = (0..12).map(|probe| probe % 5 > 2).collect();
    let volume = IrradianceVolume { resolution: glam::UVec3::new(2, 3, 2), cubes, inside };
    let place = Transform::from_xyz(1.0, 2.0, 3.0).with_scale(DVec3::new(4.0, 5.0, 6.0));
    let mut world = world(light(4, 4));
    world.spawn((Name::new("floor"), volume.clone(), place));
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for name in ["once.glb", "twice.glb"] {
        let path = folder.path().join(name);
        let report = save(&mut world, &path).unwrap();
        let [map, image] = &report.lightmaps[..] else { panic!("{:?}", report.lightmaps) };
        assert_ne!(map.path.file_stem(), image.path.file_stem(), "one name each, with every extension");
        assert_eq!(image.encoding, "rgb9e5");
        files.push(std::fs::read(&image.path).unwrap());
        world = World::new();
        let loaded = load(&mut world, &path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(loaded.notes, []);
        let mut query = world.query::<(&IrradianceVolume, &Transform, &Name)>();
        let (found, at, name) = query.single(&world).unwrap();
        assert_eq!((found.resolution, *at, name.as_str()), (volume.resolution, place, "floor"));
        assert_eq!(found.inside, volume.inside);
        for (found, original) in found.cubes.iter().zip(&volume.cubes) {
            for (found, original) in found.0.iter().zip(&original.0) {
                let bound = PackedFormat::Rgb9E5.largest_error(*original);
                assert!((*found - *original).abs().cmple(bound).all(), "{original} became {found}");
            }
        }
    }
    assert_eq!(files[0], files[1], "what is encoded once loses nothing more");
    let named = folder.path().join("twice.glb");
    let names: Vec<_> = std::fs::read_dir(folder.path().join("twice.lightmaps"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    for path in names.iter().filter(|path| path.extension().is_some_and(|extension| extension == "ktx2")) {
        std::fs::write(path, b"no image").unwrap();
    }
    let error = load(&mut World::new(), &named).unwrap_err();
    assert!(error.to_string().contains(".ktx2"), "{error}");
}
