//! The scenes to trace: the Cornell box, two furnished rooms, walls in small triangles, and the Stanford bunny in a
//! room. Their rays are in `batches`.

use glam::{Mat4, Quat, Vec3};

use super::models;

/// A closed room with a lamp under the ceiling, seen from inside; in metres, y up.
pub struct Scene {
    pub name: &'static str,
    pub triangles: Vec<[Vec3; 3]>,
    /// A corner of the lamp and the two edges from there.
    pub lamp: [Vec3; 3],
    /// The camera's position and the point that it looks at.
    pub camera: [Vec3; 2],
}

pub fn all() -> Vec<Scene> {
    let mut scenes = rooms();
    match models::shared("stanford-bunny.glb") {
        Ok(bunny) => scenes.push(bunny_room(bunny)),
        Err(reason) => eprintln!("SKIPPED: the bunny's room, {reason}"),
    }
    scenes
}

/// The scenes that need no file.
pub fn rooms() -> Vec<Scene> {
    vec![cornell(), study(), bedroom(), empty_room()]
}

/// A room from the origin to `size`, with a lamp a fifth as long and wide, and furniture.
fn room(name: &'static str, size: Vec3, furniture: Vec<[Vec3; 3]>) -> Scene {
    let mut triangles = cuboid(Mat4::from_translation(size / 2.0) * Mat4::from_scale(size), true);
    let lamp = [
        Vec3::new(size.x * 0.4, size.y * 0.99, size.z * 0.4),
        Vec3::X * size.x * 0.2,
        Vec3::Z * size.z * 0.2,
    ];
    let [corner, along, across] = lamp;
    triangles.push([corner, corner + along, corner + along + across]);
    triangles.push([corner, corner + along + across, corner + across]);
    triangles.extend(furniture);
    Scene {
        name,
        triangles,
        lamp,
        camera: [size * Vec3::new(0.06, 0.6, 0.04), size * Vec3::new(0.6, 0.3, 0.6)],
    }
}

fn cornell() -> Scene {
    let mut boxes = block(Vec3::new(1.86, 0.825, 1.69), Vec3::new(1.65, 1.65, 1.65), 0.29);
    boxes.extend(block(Vec3::new(3.68, 1.65, 3.51), Vec3::new(1.65, 3.3, 1.65), -0.31));
    room("Cornell box", Vec3::new(5.55, 5.49, 5.59), boxes)
}

fn study() -> Scene {
    let mut furniture = table(Vec3::new(2.9, 0.0, 1.2), Vec3::new(1.6, 0.74, 0.8), 0.0);
    furniture.extend(chair(Vec3::new(2.8, 0.0, 1.9), 0.4));
    // A shelf of two sides and five boards.
    for x in [0.5, 1.5] {
        furniture.extend(block(Vec3::new(x, 1.0, 3.7), Vec3::new(0.03, 2.0, 0.3), 0.0));
    }
    for i in 0..5 {
        furniture.extend(block(Vec3::new(1.0, 0.05 + 0.47 * i as f32, 3.7), Vec3::new(0.97, 0.03, 0.3), 0.0));
    }
    room("study", Vec3::new(4.2, 2.5, 4.0), furniture)
}

fn bedroom() -> Scene {
    let mut furniture = table(Vec3::new(5.0, 0.0, 2.9), Vec3::new(0.8, 0.6, 0.8), 0.7);
    // A wall with a doorway, a bed with its headboard, two bedside tables, and a wardrobe.
    for (centre, size) in [
        (Vec3::new(3.5, 1.3, 0.75), Vec3::new(0.12, 2.6, 1.5)),
        (Vec3::new(3.5, 1.3, 3.2), Vec3::new(0.12, 2.6, 1.6)),
        (Vec3::new(3.5, 2.3, 1.95), Vec3::new(0.12, 0.6, 0.9)),
        (Vec3::new(1.2, 0.25, 2.0), Vec3::new(2.0, 0.2, 1.6)),
        (Vec3::new(1.2, 0.4, 2.0), Vec3::new(1.9, 0.15, 1.5)),
        (Vec3::new(0.15, 0.5, 2.0), Vec3::new(0.08, 1.0, 1.7)),
        (Vec3::new(0.3, 0.25, 0.85), Vec3::new(0.4, 0.5, 0.4)),
        (Vec3::new(0.3, 0.25, 3.15), Vec3::new(0.4, 0.5, 0.4)),
        (Vec3::new(2.6, 1.0, 3.65), Vec3::new(1.2, 2.0, 0.6)),
        (Vec3::new(5.8, 0.9, 0.4), Vec3::new(0.9, 1.8, 0.4)),
    ] {
        furniture.extend(block(centre, size, 0.0));
    }
    room("two rooms", Vec3::new(7.0, 2.6, 4.0), furniture)
}

/// Only walls, in small triangles, so that the highest planes of the scene are full of them.
fn empty_room() -> Scene {
    const ALONG: usize = 100;
    let mut scene = room("walls in small triangles", Vec3::new(4.0, 3.0, 4.0), Vec::new());
    let at = |[a, b, c]: [Vec3; 3], i: usize, j: usize| {
        a + (b - a) * (i as f32 / ALONG as f32) + (c - a) * (j as f32 / ALONG as f32)
    };
    let pieces = |triangle: [Vec3; 3]| {
        let row = move |i: usize| (0..ALONG - i).map(move |j| (i, j));
        (0..ALONG).flat_map(row).flat_map(move |(i, j)| {
            let [near, right, up] = [at(triangle, i, j), at(triangle, i + 1, j), at(triangle, i, j + 1)];
            let turned = (i + j + 1 < ALONG).then(|| [right, at(triangle, i + 1, j + 1), up]);
            [Some([near, right, up]), turned].into_iter().flatten()
        })
    };
    scene.triangles = scene.triangles.into_iter().flat_map(pieces).collect();
    scene
}

fn bunny_room(mut bunny: Vec<[Vec3; 3]>) -> Scene {
    let points = || bunny.iter().flatten().copied();
    let (min, max) = (points().fold(Vec3::INFINITY, Vec3::min), points().fold(Vec3::NEG_INFINITY, Vec3::max));
    let size = Vec3::new(4.0, 3.0, 4.0);
    let scale = 2.0 / (max - min).max_element();
    let foot = Vec3::new((min.x + max.x) / 2.0, min.y, (min.z + max.z) / 2.0);
    for vertex in bunny.iter_mut().flatten() {
        *vertex = (*vertex - foot) * scale + Vec3::new(size.x / 2.0, 0.0, size.z / 2.0);
    }
    room("bunny in a room", size, bunny)
}

/// A table top on four legs.
fn table(foot: Vec3, size: Vec3, turned: f32) -> Vec<[Vec3; 3]> {
    let turn = Quat::from_rotation_y(turned);
    let mut triangles = block(foot + Vec3::Y * size.y, Vec3::new(size.x, 0.04, size.z), turned);
    for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let leg = turn * (size * Vec3::new(x * 0.45, 0.5, z * 0.45));
        triangles.extend(block(foot + leg, Vec3::new(0.05, size.y, 0.05), turned));
    }
    triangles
}

fn chair(foot: Vec3, turned: f32) -> Vec<[Vec3; 3]> {
    let mut triangles = table(foot, Vec3::new(0.42, 0.45, 0.42), turned);
    let back = Quat::from_rotation_y(turned) * Vec3::new(0.0, 0.7, 0.2);
    triangles.extend(block(foot + back, Vec3::new(0.42, 0.5, 0.03), turned));
    triangles
}

fn block(centre: Vec3, size: Vec3, turned: f32) -> Vec<[Vec3; 3]> {
    cuboid(Mat4::from_scale_rotation_translation(size, Quat::from_rotation_y(turned), centre), false)
}

/// The unit cube around the origin, transformed by `place`; 12 triangles.
fn cuboid(place: Mat4, inward: bool) -> Vec<[Vec3; 3]> {
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        place.transform_point3(Vec3::new(side(0), side(1), side(2)))
    };
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|[a, b, c]| if inward { [a, c, b] } else { [a, b, c] })
        .map(|triangle| triangle.map(corner))
        .collect()
}
