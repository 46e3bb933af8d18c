//! Direct and bounced light as maps of their own: they add up to the map, and each is what a scene with nothing but that light has.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use lumbre_bake::{
    Bake, BakeOptions, BakedScene, Density, PlacedLight, PlacedPrimitive, Quality, SceneObject, StaticScene,
};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};

fn options() -> BakeOptions {
    BakeOptions {
        density: Density::TexelsPerMeter(10.0),
        quality: Quality::Draft,
        separate_light: true,
        ..BakeOptions::default()
    }
}

/// The inside of a box of this size.
fn room(size: Vec3) -> TriangleMesh {
    let mut mesh = shapes::cuboid(size, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

/// A room of this reflectance with a box on its floor, a lamp of this mode, and a panel that shines.
fn scene(reflectance: f32, mode: BakeMode) -> StaticScene {
    let matt = |reflectance: f32| {
        let front = Surface { diffuse: Vec3::new(1.0, 0.8, 0.6) * reflectance, ..Surface::default() };
        Material { front, ..Material::default() }
    };
    let placed = |mesh: TriangleMesh, material, at: DVec3| PlacedPrimitive {
        mesh: Arc::new(mesh),
        material,
        transform: DAffine3::from_translation(at),
        ..PlacedPrimitive::default()
    };
    let mut shining = matt(0.0);
    shining.front.emission = Vec3::new(2.0, 3.0, 4.0);
    let panel = shapes::cuboid(Vec3::new(1.0, 0.05, 0.5), 1);
    let objects = vec![
        SceneObject::new(
            "room",
            vec![placed(room(Vec3::new(4.0, 3.0, 4.0)), matt(reflectance), DVec3::new(0.0, 1.5, 0.0))],
        ),
        SceneObject::new(
            "box",
            vec![placed(shapes::cuboid(Vec3::splat(0.8), 1), matt(reflectance), DVec3::new(0.6, 0.4, 0.5))],
        ),
        SceneObject::new("panel", vec![placed(panel, shining, DVec3::new(0.0, 2.9, -1.0))]),
    ];
    let lamp = Light { bake: mode, ..Light::point(Vec3::splat(6.0)) };
    let lights = vec![PlacedLight { light: lamp, position: DVec3::new(-1.0, 2.0, 1.0), axis: DVec3::NEG_Z }];
    StaticScene { objects, lights, ..StaticScene::default() }
}

fn bake(scene: StaticScene, options: BakeOptions) -> BakedScene {
    Bake::new(&options).run_scene(scene).expect("the scene bakes")
}

#[test]
fn both_maps_add_up_to_the_map_and_leave_it_as_it_is() {
    for atlas_size in [None, Some(256)] {
        let asked = BakeOptions { atlas_size, ..options() };
        let whole = bake(scene(0.6, BakeMode::Static), BakeOptions { separate_light: false, ..asked });
        let baked = bake(scene(0.6, BakeMode::Static), asked);
        let (mut direct_sum, mut bounced_sum) = (0.0, 0.0);
        for (plain, map) in whole.maps.iter().zip(&baked.maps) {
            assert_eq!(plain.image, map.image, "asking for both does not change the map");
            let separate = map.separate.as_ref().unwrap();
            assert_eq!((separate.direct.width, separate.bounced.height), (map.image.width, map.image.height));
            let both = separate.direct.texels.iter().zip(&separate.bounced.texels);
            for (&texel, (&direct, &bounced)) in map.image.texels.iter().zip(both) {
                assert!(direct.min_element() >= 0.0 && bounced.min_element() >= 0.0, "{direct} {bounced}");
                let apart = (direct + bounced - texel).abs().max_element();
                assert!(apart <= 2.0 * f32::EPSILON * texel.max_element(), "{texel}: {direct} + {bounced}");
                direct_sum += direct.element_sum();
                bounced_sum += bounced.element_sum();
            }
        }
        assert!(direct_sum > 0.0 && bounced_sum > 0.2 * direct_sum, "{direct_sum} {bounced_sum}");
        let names: Vec<&str> = baked
            .maps
            .iter()
            .filter_map(|map| map.separate.as_ref())
            .map(|own| own.direct.name.as_str())
            .collect();
        assert!(names[0].ends_with(".direct.lightmap.exr"), "{names:?}");
    }
}

/// The direct light of a room is all the light of the same room with black walls.
#[test]
fn direct_light_is_that_of_black_walls() {
    let baked = bake(scene(0.6, BakeMode::Static), options());
    let black = bake(scene(0.0, BakeMode::Static), options());
    let (mut squares, mut light, mut texels) = (0.0, 0.0, 0.0);
    for (map, black) in baked.maps.iter().zip(&black.maps) {
        let direct = &map.separate.as_ref().unwrap().direct.texels;
        let none = black.separate.as_ref().unwrap();
        assert!(none.bounced.texels.iter().all(|texel| *texel == Vec3::ZERO), "nothing bounces off black");
        let known = map.errors.0.iter().map(|error| error.is_finite());
        for ((direct, black), _) in
            direct.iter().zip(&black.image.texels).zip(known).filter(|(_, known)| *known)
        {
            squares += f64::from((*direct - *black).length_squared()) / 3.0;
            light += f64::from(black.element_sum()) / 3.0;
            texels += 1.0;
        }
    }
    let error = (squares / f64::max(texels, 1.0)).sqrt() / (light / f64::max(texels, 1.0));
    println!(
        "direct light beside that of black walls: {:.3} % of its mean over {texels} texels",
        100.0 * error
    );
    // Both have the same samples; what differs is what closing seams has done to the whole.
    assert!(texels > 1000.0 && error < 0.01, "{error}");
}

/// A mixed lamp lights frames directly: of it the maps hold the bounces only, and the direct map nothing.
#[test]
fn a_mixed_lamp_has_no_direct_light_in_the_maps() {
    let mut mixed = scene(0.6, BakeMode::Mixed);
    mixed.objects.truncate(2);
    let baked = bake(mixed, options());
    let separate = baked.maps.iter().filter_map(|map| map.separate.as_ref());
    let mut bounced = 0.0;
    for own in separate {
        assert!(own.direct.texels.iter().all(|texel| *texel == Vec3::ZERO));
        bounced += own.bounced.texels.iter().map(|texel| texel.element_sum()).sum::<f32>();
    }
    assert!(bounced > 0.0);
}
