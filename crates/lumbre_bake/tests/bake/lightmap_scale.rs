//! The lightmap scale of an object, which multiplies its density of texels.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use lumbre_bake::{
    Bake, BakeOptions, BakedScene, Density, PlacedPrimitive, Quality, SceneObject, StaticScene,
};
use lumbre_mesh::{TriangleMesh, shapes};

/// Bakes two equal floors beside each other under a sky, the second one with this lightmap scale.
fn bake(density: Density, scale: f64) -> BakedScene {
    let mesh = Arc::new(shapes::plane(2.0, 2.0, 1, 1));
    let floor = |name: &str, x: f64, lightmap_scale: f64| {
        let transform = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        let primitive = PlacedPrimitive { mesh: Arc::clone(&mesh), transform, ..PlacedPrimitive::default() };
        SceneObject { lightmap_scale, ..SceneObject::new(name, vec![primitive]) }
    };
    let objects = vec![floor("plain", -1.5, 1.0), floor("scaled", 1.5, scale)];
    let scene = StaticScene { objects, sky: Vec3::ONE, ..StaticScene::default() };
    let options = BakeOptions { density, quality: Quality::Draft, ..BakeOptions::default() };
    Bake::new(&options).run_scene(scene).expect("the scene bakes")
}

/// The texels per metre of an object, by the area of its lightmap coordinates.
fn density(baked: &BakedScene, object: usize) -> f64 {
    let map = &baked.maps[baked.objects[object].map].image;
    let mesh: &TriangleMesh = &baked.objects[object].meshes[0];
    let (mut texels, mut area) = (0.0, 0.0);
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|vertex| mesh.uv1[vertex as usize].as_dvec2());
        texels += 0.5 * (b - a).perp_dot(c - a).abs() * f64::from(map.width * map.height);
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
        area += 0.5 * (b - a).cross(c - a).length();
    }
    (texels / area).sqrt()
}

#[test]
fn the_scale_multiplies_the_density() {
    for scale in [0.5, 1.0, 2.0, 3.0] {
        let baked = bake(Density::TexelsPerMeter(16.0), scale);
        let (plain, scaled) = (density(&baked, 0), density(&baked, 1));
        // The size of a chart is rounded to whole texels.
        assert!((plain / 16.0 - 1.0).abs() < 0.1, "{plain}");
        assert!((scaled / (16.0 * scale) - 1.0).abs() < 0.1, "{scaled} at a scale of {scale}");
        let sky = std::f32::consts::PI;
        for map in &baked.maps {
            // Under an open sky E = π L everywhere, at any density.
            let lit = map.image.texels.iter().zip(map.errors.0.iter()).filter(|(_, error)| error.is_finite());
            assert!(lit.clone().count() > 40);
            lit.for_each(|(texel, _)| {
                assert!((*texel * sky - sky).abs().max_element() < 0.02 * sky, "{texel}")
            });
        }
    }
}

#[test]
fn the_automatic_density_keeps_the_total_of_texels() {
    let (plain, scaled) = (bake(Density::Automatic, 1.0), bake(Density::Automatic, 3.0));
    let (before, after) = (plain.report.texels as f64, scaled.report.texels as f64);
    assert!((after / before - 1.0).abs() < 0.1, "{before} and {after}");
    let ratio = density(&scaled, 1) / density(&scaled, 0);
    assert!((ratio / 3.0 - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn maps_of_a_size_follow_the_scale_within_their_limits() {
    for (scale, side) in [(1.0, 32), (2.0, 64), (0.5, 16), (1e-6, 4)] {
        let baked = bake(Density::MapSize(32), scale);
        let sides = [0, 1].map(|object| baked.maps[baked.objects[object].map].image.width);
        assert_eq!(sides, [32, side], "at a scale of {scale}");
    }
}
