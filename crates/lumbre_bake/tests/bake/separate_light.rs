//! Direct and bounced light in separate maps: they must add up to the whole map, and each must equal the light of a
//! scene with only that light.

use std::sync::Arc;

use crate::common::shapes::room;
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

/// A room of this reflectance with a box on its floor, a point light of this mode, and an emissive panel.
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
fn both_maps_add_up_to_the_whole_map_and_do_not_change_it() {
    for atlas_size in [None, Some(256)] {
        let options = BakeOptions { atlas_size, ..options() };
        let whole = bake(scene(0.6, BakeMode::Static), BakeOptions { separate_light: false, ..options });
        let baked = bake(scene(0.6, BakeMode::Static), options);
        let (mut direct_sum, mut bounced_sum) = (0.0, 0.0);
        for (plain, map) in whole.maps.iter().zip(&baked.maps) {
            assert_eq!(plain.image, map.image, "asking for both does not change the map");
            let separate = map.separate.as_ref().unwrap();
            assert_eq!((separate.direct.width, separate.bounced.height), (map.image.width, map.image.height));
            let both = separate.direct.texels.iter().zip(&separate.bounced.texels);
            for (&texel, (&direct, &bounced)) in map.image.texels.iter().zip(both) {
                assert!(direct.min_element() >= 0.0 && bounced.min_element() >= 0.0, "{direct} {bounced}");
                let difference = (direct + bounced - texel).abs().max_element();
                assert!(
                    difference <= 2.0 * f32::EPSILON * texel.max_element(),
                    "{texel}: {direct} + {bounced}"
                );
                direct_sum += direct.element_sum();
                bounced_sum += bounced.element_sum();
            }
        }
        assert!(direct_sum > 0.0 && bounced_sum > 0.2 * direct_sum, "{direct_sum} {bounced_sum}");
        let names: Vec<&str> = baked
            .maps
            .iter()
            .filter_map(|map| map.separate.as_ref())
            .map(|separate| separate.direct.name.as_str())
            .collect();
        assert!(names[0].ends_with(".direct.lightmap.exr"), "{names:?}");
    }
}

/// The direct light of a room equals the entire light of the same room with black walls.
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
    // Both use the same samples; they differ only in how closing the seams has changed the whole maps.
    assert!(texels > 1000.0 && error < 0.01, "{error}");
}

/// Frames light objects directly with a mixed light: the maps contain only its bounces, and the direct maps are black.
#[test]
fn a_mixed_lamp_has_no_direct_light_in_the_maps() {
    let mut mixed = scene(0.6, BakeMode::Mixed);
    mixed.objects.truncate(2);
    let baked = bake(mixed, options());
    let separate_maps = baked.maps.iter().filter_map(|map| map.separate.as_ref());
    let mut bounced = 0.0;
    for separate in separate_maps {
        assert!(separate.direct.texels.iter().all(|texel| *texel == Vec3::ZERO));
        bounced += separate.bounced.texels.iter().map(|texel| texel.element_sum()).sum::<f32>();
    }
    assert!(bounced > 0.0);
}
