//! Textures that use TEXCOORD_1, which the lightmap needs: which coordinates are moved, which stay, and which scenes
//! are refused; also after saving and loading.

use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{Vec2, Vec3};
use lumbre_bake::{Bake, BakeError, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{
    Image, Lightmap, MaterialTextures, Mesh, Name, OcclusionTexture, StaticObject, TextureReference,
    Transform,
};

/// A floor whose first set of coordinates is constant and whose second one repeats a texture three times.
fn floor() -> Arc<TriangleMesh> {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    Arc::new(TriangleMesh {
        positions: corners.map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec(),
        normals: vec![Vec3::Y; 4],
        uv0: vec![Vec2::splat(0.25); 4],
        uv1: corners.map(|[x, z]| Vec2::new(x + 1.0, z + 1.0) * 1.5).to_vec(),
        indices: vec![0, 2, 1, 0, 3, 2],
        ..TriangleMesh::default()
    })
}

/// A texture whose left half is black and whose right half is white.
fn stripes(tex_coord: u32) -> TextureReference {
    let row = [[0u8, 0, 0, 255], [255; 4]].concat();
    TextureReference {
        tex_coord,
        ..TextureReference::new(Arc::new(Image {
            name: "stripes".into(),
            width: 2,
            height: 2,
            rgba: row.repeat(2),
        }))
    }
}

fn matt() -> Material {
    Material {
        front: Surface { diffuse: Vec3::ONE, ambient: Vec3::ONE, ..Surface::default() },
        ..Material::default()
    }
}

fn spawn(world: &mut World, name: &'static str, textures: MaterialTextures) -> Entity {
    world.spawn((Name::new(name), Mesh(floor()), matt(), textures, StaticObject)).id()
}

fn run(world: &mut World) -> Result<BakeReport, BakeError> {
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::from_xyz(0.0, 1.0, 0.0)));
    let options =
        BakeOptions { density: Density::MapSize(24), quality: Quality::Draft, ..BakeOptions::default() };
    Bake::new(&options).run(world)
}

/// The texture coordinates at each corner of each triangle.
fn texture_reading(world: &World, entity: Entity) -> Vec<Vec2> {
    let mesh = &world.get::<Mesh>(entity).expect("it was baked").0;
    let texture =
        world.get::<MaterialTextures>(entity).expect("it was baked").base_color.as_ref().expect("it has one");
    let coordinates = if texture.tex_coord == 0 { &mesh.uv0 } else { &mesh.uv1 };
    mesh.indices.iter().map(|&vertex| coordinates[vertex as usize]).collect()
}

#[test]
fn a_tiling_second_set_moves_to_the_first_and_survives_the_file() {
    let mut world = World::new();
    let textures = MaterialTextures { base_color: Some(stripes(1)), ..MaterialTextures::default() };
    let entity = spawn(&mut world, "tiled floor", textures);
    let before = texture_reading(&world, entity);
    let report = run(&mut world).expect("the scene bakes");
    assert!(
        report.warnings.iter().any(|line| line.contains("tiled floor: its textures' coordinates were moved"))
    );
    assert_eq!(texture_reading(&world, entity), before);
    let mesh = &world.get::<Mesh>(entity).expect("it was baked").0;
    assert!(mesh.uv1.iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()));
    assert!(world.get::<Lightmap>(entity).is_some());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("floor.glb");
    lumbre_scene::save(&mut world, &path).unwrap();
    let mut again = World::new();
    lumbre_scene::load(&mut again, &path).unwrap();
    let mut query = again.query::<(Entity, &Lightmap, &MaterialTextures)>();
    let (loaded, _, textures) = query.single(&again).unwrap();
    assert_eq!(textures.base_color.as_ref().unwrap().tex_coord, 0);
    assert_eq!(texture_reading(&again, loaded), before);
}

#[test]
fn both_sets_in_use_are_refused_by_name_unless_they_are_the_same() {
    let both = || MaterialTextures {
        base_color: Some(stripes(1)),
        emissive: Some(stripes(0)),
        ..MaterialTextures::default()
    };
    let mut world = World::new();
    spawn(&mut world, "painted floor", both());
    assert_eq!(run(&mut world), Err(BakeError::CoordinatesInUse { object: "painted floor".into() }));

    let mut world = World::new();
    let entity = spawn(&mut world, "painted floor", both());
    let mut same = floor().as_ref().clone();
    same.uv0.clone_from(&same.uv1);
    world.entity_mut(entity).insert(Mesh(Arc::new(same)));
    let before = texture_reading(&world, entity);
    run(&mut world).expect("the scene bakes");
    assert_eq!(texture_reading(&world, entity), before);
}

#[test]
fn occlusion_on_the_second_set_makes_way_for_the_lightmap() {
    let textures = MaterialTextures {
        base_color: Some(stripes(0)),
        occlusion: Some(OcclusionTexture { texture: stripes(1), strength: 1.0 }),
        ..MaterialTextures::default()
    };
    let mut world = World::new();
    let entity = spawn(&mut world, "painted floor", textures);
    let before = texture_reading(&world, entity);
    run(&mut world).expect("the scene bakes");
    assert_eq!(texture_reading(&world, entity), before);
    let kept = world.get::<MaterialTextures>(entity).expect("it is painted still");
    assert!(kept.occlusion.is_none(), "it would read the lightmap's coordinates");
}

#[test]
fn a_shared_mesh_keeps_each_material_its_own_coordinates() {
    let mesh = floor();
    let mut world = World::new();
    let [first, second] = [0, 1].map(|tex_coord| {
        let textures =
            MaterialTextures { base_color: Some(stripes(tex_coord)), ..MaterialTextures::default() };
        let at = Transform::from_xyz(0.0, 0.25 * f64::from(tex_coord), 0.0);
        world.spawn((Mesh(mesh.clone()), matt(), textures, StaticObject, at)).id()
    });
    let before = [first, second].map(|entity| texture_reading(&world, entity));
    run(&mut world).expect("the scene bakes");
    assert_eq!([first, second].map(|entity| texture_reading(&world, entity)), before);
}
