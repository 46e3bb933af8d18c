//! Baked light bounce by bounce: the light that arrives directly at the texels of a level's lightmaps is gathered
//! again and again by the same rays, and each time one more bounce is known. This is the Jacobi iteration of the
//! radiosity system with form factors by cosine-distributed rays. The baker does not stop between bounces, which is
//! why this way stands beside it: it shows what each of them brings and takes.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use glam::{Affine3A, DVec3, Mat3, Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, Material, SurfaceSample, decode_srgb_byte, shininess_from_roughness};
use lumbre_rays::{Bvh, Ray, offset_ray_origin, triangle_extent};
use lumbre_scene::{
    GlobalTransform, Image, Lightmap, LightmapImage, MaterialTextures, Mesh, StaticObject, hidden_entities,
};
use rayon::prelude::*;

use crate::rounds::milliseconds_since;

/// The lightmaps of a level as a graph along which light bounces.
pub struct BounceByBounce {
    images: Vec<Arc<LightmapImage>>,
    /// The texels that show a surface.
    texels: Vec<Place>,
    /// Light that has arrived after the bounces so far, and by the last of them: E/π of each texel.
    arrived: Vec<Vec3>,
    last: Vec<Vec3>,
    /// What the rays of each texel hit: so many for each texel, one texel after the other.
    hits: Vec<Reflected>,
    rays: usize,
    /// Milliseconds of casting the rays.
    pub cast_ms: f64,
}

/// Largest number of hits that are kept, of 16 bytes each.
const MOST_HITS: usize = 1 << 25;

/// A texel of one of the images.
#[derive(Clone, Copy)]
struct Place {
    image: usize,
    texel: usize,
}

/// The texel that a ray hits, and its surface's diffuse reflectance; black where it hits nothing that reflects.
#[derive(Clone, Copy, Default)]
struct Reflected {
    texel: u32,
    reflectance: Vec3,
}

/// A point of a triangle that a texel shows, by the weights of the triangle's corners.
#[derive(Clone, Copy)]
struct Shown {
    surface: usize,
    weights: [f32; 3],
}

/// A triangle in the world, with the lightmap that it shows.
struct Surface {
    corners: [Vec3; 3],
    normals: [Vec3; 3],
    facing: Vec3,
    coordinates: [Vec2; 3],
    image: usize,
    reflectance: Vec3,
}

/// Returns the reason why the bounces of a World cannot be followed one by one, or `None` if they can: only light that
/// its lightmaps hold can be gathered from them.
pub fn not_followed(world: &mut World) -> Option<&'static str> {
    let mut lights = world.query::<&Light>();
    let is_mixed = |light: &Light| light.enabled && light.bake == BakeMode::Mixed;
    lights
        .iter(world)
        .any(is_mixed)
        .then_some("the direct light of its mixed lamps is not in the lightmaps, so that their bounces cannot be followed")
}

impl BounceByBounce {
    /// Casts rays from each texel of a World whose lightmaps hold direct light only: `most_rays`, or fewer where there
    /// are many texels, so that their hits take half a gigabyte at most. Reflectances are those of the materials; a
    /// texture counts as its mean, and backs of surfaces reflect nothing.
    pub fn new(world: &mut World, most_rays: usize) -> Self {
        let begun = Instant::now();
        let (images, surfaces) = surfaces(world);
        let corners: Vec<[Vec3; 3]> = surfaces.iter().map(|surface| surface.corners).collect();
        let bvh = Bvh::build(&corners);
        let mut numbers: Vec<Vec<u32>> =
            images.iter().map(|image| vec![NOTHING; image.texels.len()]).collect();
        let (mut texels, mut points): (Vec<Place>, Vec<Vec<Shown>>) = (Vec::new(), Vec::new());
        for (number, surface) in surfaces.iter().enumerate() {
            for (texel, weights) in covered(surface, &images[surface.image]) {
                let known = &mut numbers[surface.image][texel];
                if *known == NOTHING {
                    *known = texels.len() as u32;
                    texels.push(Place { image: surface.image, texel });
                    points.push(Vec::new());
                }
                points[*known as usize].push(Shown { surface: number, weights });
            }
        }
        let rays = most_rays.min(MOST_HITS / texels.len().max(1)).max(1);
        let hits = points
            .par_iter()
            .enumerate()
            .flat_map_iter(|(texel, points)| {
                let (surfaces, images, numbers, bvh) = (&surfaces, &images, &numbers, &bvh);
                (0..rays).map(move |ray| {
                    let Shown { surface, weights } = points[ray % points.len()];
                    let surface = &surfaces[surface];
                    let (position, normal) = surface.point(weights);
                    let direction = cosine_direction(normal, ray, rays, texel);
                    let is_outside = direction.dot(surface.facing) > 0.0;
                    let origin =
                        offset_ray_origin(position, surface.facing, triangle_extent(&surface.corners));
                    let hit = bvh.closest_hit(&Ray::new(origin, direction)).filter(|_| is_outside);
                    hit.map_or_else(Reflected::default, |hit| {
                        let reached = &surfaces[hit.triangle as usize];
                        let (v, w) = hit.barycentric;
                        reached.reflected([1.0 - v - w, v, w], direction, images, numbers)
                    })
                })
            })
            .collect();
        let arrived: Vec<Vec3> = texels.iter().map(|at| images[at.image].texels[at.texel]).collect();
        let last = arrived.clone();
        Self { images, texels, arrived, last, hits, rays, cast_ms: milliseconds_since(begun) }
    }

    /// Adds one more bounce, and returns the milliseconds that it took.
    pub fn bounce(&mut self) -> f64 {
        let begun = Instant::now();
        let Self { hits, last, rays, .. } = self;
        let share = (*rays as f32).recip();
        let gathered: Vec<Vec3> = hits
            .par_chunks(*rays)
            .map(|hits| {
                share * hits.iter().map(|hit| hit.reflectance * last[hit.texel as usize]).sum::<Vec3>()
            })
            .collect();
        for (sum, light) in self.arrived.iter_mut().zip(&gathered) {
            *sum += *light;
        }
        self.last = gathered;
        milliseconds_since(begun)
    }

    /// Returns the light of the last bounce as a share of all light so far, over the texels, mean of the channels.
    pub fn share_of_last(&self) -> f64 {
        let sum = |light: &[Vec3]| light.iter().map(|light| f64::from(light.element_sum())).sum::<f64>();
        sum(&self.last) / sum(&self.arrived).max(f64::MIN_POSITIVE)
    }

    /// Returns the number of rays that are cast from each texel.
    pub fn rays(&self) -> usize {
        self.rays
    }

    /// Returns the number of texels that light is gathered for.
    pub fn texels(&self) -> usize {
        self.texels.len()
    }

    /// Gives another World the lightmaps with the bounces so far, wherever `baked`, whose lightmaps these are, has
    /// one. Both have the same entities.
    pub fn show(&self, baked: &mut World, world: &mut World) {
        let mut lit: Vec<Vec<Option<Vec3>>> =
            self.images.iter().map(|image| vec![None; image.texels.len()]).collect();
        for (at, light) in self.texels.iter().zip(&self.arrived) {
            lit[at.image][at.texel] = Some(*light);
        }
        let images: HashMap<_, _> = self
            .images
            .iter()
            .zip(lit)
            .map(|(image, lit)| {
                let texels = with_borders(lit, image.width as usize);
                (Arc::as_ptr(image), Arc::new(LightmapImage { texels, ..(**image).clone() }))
            })
            .collect();
        let mut maps = baked.query::<(Entity, &Mesh, &Lightmap)>();
        for (entity, mesh, map) in maps.iter(baked) {
            let image = images.get(&Arc::as_ptr(&map.image));
            if let (Some(image), Ok(mut entity)) = (image, world.get_entity_mut(entity)) {
                entity.insert((mesh.clone(), Lightmap { image: Arc::clone(image) }));
            }
        }
    }
}

/// The number of a texel that shows no surface.
const NOTHING: u32 = u32::MAX;

/// Returns the lightmaps of a World, and the triangles that show them.
fn surfaces(world: &mut World) -> (Vec<Arc<LightmapImage>>, Vec<Surface>) {
    let hidden = hidden_entities(world);
    let mut objects = world.query_filtered::<
        (Entity, &Mesh, &GlobalTransform, &Material, Option<&MaterialTextures>, &Lightmap),
        With<StaticObject>,
    >();
    let (mut images, mut surfaces): (Vec<Arc<LightmapImage>>, _) = (Vec::new(), Vec::new());
    for (entity, mesh, place, material, textures, map) in objects.iter(world) {
        if hidden.contains(&entity) {
            continue;
        }
        let known = images.iter().position(|known| Arc::ptr_eq(known, &map.image));
        let image = known.unwrap_or_else(|| {
            images.push(Arc::clone(&map.image));
            images.len() - 1
        });
        let reflectance = mean_reflectance(material, textures);
        let matrix = place.0;
        let world_from_mesh = Affine3A {
            matrix3: Mat3::from_cols_array(&matrix.matrix3.to_cols_array().map(|value| value as f32)).into(),
            translation: matrix.translation.as_vec3().into(),
        };
        let of_mesh = surfaces_of(&mesh.0, world_from_mesh, matrix.matrix3.determinant() < 0.0);
        surfaces.extend(of_mesh.map(|surface| Surface { image, reflectance, ..surface }));
    }
    (images, surfaces)
}

/// Returns the triangles of a mesh in the world that have an area and lightmap coordinates.
fn surfaces_of(
    mesh: &TriangleMesh,
    world_from_mesh: Affine3A,
    is_mirrored: bool,
) -> impl Iterator<Item = Surface> {
    let of_normals = Mat3::from(world_from_mesh.matrix3).inverse().transpose();
    let triangles = mesh.indices.as_chunks::<3>().0.iter();
    triangles.filter_map(move |triangle| {
        let positions = triangle.map(|index| mesh.positions.get(index as usize).copied());
        let coordinates = triangle.map(|index| mesh.uv1.get(index as usize).copied());
        let [Some(a), Some(b), Some(c)] = positions else { return None };
        let [Some(first), Some(second), Some(third)] = coordinates else { return None };
        let corners = [a, b, c].map(|point| world_from_mesh.transform_point3(point));
        let winding = if is_mirrored { -1.0 } else { 1.0 };
        let facing = (winding * (corners[1] - corners[0]).cross(corners[2] - corners[0])).try_normalize()?;
        let normal = |index: u32| {
            let own = mesh.normals.get(index as usize).map(|normal| of_normals * *normal);
            own.and_then(Vec3::try_normalize).unwrap_or(facing)
        };
        Some(Surface {
            corners,
            normals: triangle.map(normal),
            facing,
            coordinates: [first, second, third],
            image: 0,
            reflectance: Vec3::ZERO,
        })
    })
}

/// Points at which a texel is looked at, along each side. None lies on its centre: those of a chart's border may lie on
/// the edge of a wall, from which rays would pass the wall beside it.
const POINTS: u32 = 4;

/// Returns the texels of which a triangle covers points, with the weights of its corners at each of these.
fn covered(surface: &Surface, image: &LightmapImage) -> Vec<(usize, [f32; 3])> {
    let size = Vec2::new((POINTS * image.width) as f32, (POINTS * image.height) as f32);
    let [a, b, c] = surface.coordinates.map(|at| at * size);
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 || !area.is_finite() {
        return Vec::new();
    }
    let low = a.min(b).min(c).floor().max(Vec2::ZERO).as_uvec2();
    let high = a.max(b).max(c).ceil().min(size).as_uvec2();
    let points = (low.y..high.y).flat_map(|y| (low.x..high.x).map(move |x| (x, y)));
    let inside = points.filter_map(|(x, y)| {
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let second = (at - a).perp_dot(c - a) / area;
        let third = (b - a).perp_dot(at - a) / area;
        let weights = [1.0 - second - third, second, third];
        let texel = (y / POINTS) as usize * image.width as usize + (x / POINTS) as usize;
        weights.iter().all(|weight| *weight >= 0.0).then_some((texel, weights))
    });
    inside.collect()
}

impl Surface {
    /// Returns the position and the normal of a point.
    fn point(&self, weights: [f32; 3]) -> (Vec3, Vec3) {
        let mixed = |of: &[Vec3; 3]| of.iter().zip(weights).map(|(one, weight)| *one * weight).sum::<Vec3>();
        (mixed(&self.corners), mixed(&self.normals).try_normalize().unwrap_or(self.facing))
    }

    /// Returns what a ray that arrives from this direction finds at a point. The light at a point whose texel
    /// shows no surface at any of the points is that of the nearest texel that does, at most two texels away.
    fn reflected(
        &self,
        weights: [f32; 3],
        direction: Vec3,
        images: &[Arc<LightmapImage>],
        numbers: &[Vec<u32>],
    ) -> Reflected {
        // The back of a surface shows no texel, even where the material has one.
        if direction.dot(self.facing) >= 0.0 {
            return Reflected::default();
        }
        let image = &images[self.image];
        let (width, height) = (image.width as i32, image.height as i32);
        let at: Vec2 = self.coordinates.iter().zip(weights).map(|(one, weight)| *one * weight).sum();
        let at = at * Vec2::new(width as f32, height as f32);
        let around = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (x, y)));
        let known = around.filter_map(|(x, y)| {
            let (x, y) = (at.x.floor() as i32 + x, at.y.floor() as i32 + y);
            let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
            let number = is_inside.then(|| numbers[self.image][(y * width + x) as usize]);
            let number = number.filter(|number| *number != NOTHING)?;
            Some((Vec2::new(x as f32 + 0.5, y as f32 + 0.5).distance_squared(at), number))
        });
        let nearest = known.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest
            .map_or_else(Reflected::default, |(_, texel)| Reflected { texel, reflectance: self.reflectance })
    }
}

/// Returns a direction about a normal, distributed by its cosine: those of a texel are a Hammersley set, turned by a
/// hash of the texel.
fn cosine_direction(normal: Vec3, ray: usize, rays: usize, texel: usize) -> Vec3 {
    let turned = |value: f64, salt: u32| {
        let hash = (texel as u32).wrapping_mul(0x9e37_79b9) ^ salt;
        let hash = (hash ^ (hash >> 15)).wrapping_mul(0x85eb_ca6b);
        (value + f64::from(hash ^ (hash >> 13)) / f64::from(u32::MAX)).fract()
    };
    let radical_inverse = f64::from((ray as u32).reverse_bits()) / 2f64.powi(32);
    let radius = turned((ray as f64 + 0.5) / rays as f64, 0x68bc_21eb).sqrt();
    let angle = std::f64::consts::TAU * turned(radical_inverse, 0x02e5_be93);
    let up = DVec3::new(radius * angle.cos(), radius * angle.sin(), (1.0 - radius * radius).max(0.0).sqrt());
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (tangent * up.x as f32 + bitangent * up.y as f32 + normal * up.z as f32).normalize()
}

/// Returns the mean of a picture of colours, in linear light.
fn mean(image: &Image, decode: impl Fn(u8) -> f64) -> Vec3 {
    let pixels = image.rgba.as_chunks::<4>().0;
    let sum: DVec3 = pixels
        .iter()
        .map(|[red, green, blue, _]| DVec3::from_array([*red, *green, *blue].map(&decode)))
        .sum();
    (sum / pixels.len().max(1) as f64).as_vec3()
}

/// Returns the reflectance of a material's front for baked light, whose textures count by their means.
fn mean_reflectance(material: &Material, textures: Option<&MaterialTextures>) -> Vec3 {
    let base = textures.and_then(|textures| textures.base_color.as_ref());
    let tint = base.map_or(Vec3::ONE, |texture| mean(&texture.image, decode_srgb_byte));
    let mut front = material.front;
    front.specular *= tint;
    if let Some(slot) = textures.and_then(|textures| textures.metallic_roughness.as_ref()) {
        let texel = mean(&slot.texture.image, |byte| f64::from(byte) / 255.0);
        let metallic = slot.metallic * texel.z;
        front.diffuse = slot.base_color * (1.0 - metallic);
        front.specular = slot.dielectric.lerp(slot.base_color * tint, metallic);
        front.shininess = shininess_from_roughness(slot.roughness * texel.y);
    }
    front.diffuse *= tint;
    let sample = SurfaceSample { lobe: material.lobe, ..SurfaceSample::from(&front) };
    match material.reflects_as_metal() {
        true => front.diffuse + sample.reflectance_as_metal().as_vec3(),
        false => front.diffuse,
    }
}

/// Fills texels without light from their neighbours, as far as filtering reads them.
fn with_borders(mut texels: Vec<Option<Vec3>>, width: usize) -> Vec<Vec3> {
    for _ in 0..2 {
        let filled = |(at, texel): (usize, &Option<Vec3>)| {
            let (x, y) = (at % width, at / width);
            let around = (y.saturating_sub(1)..=y + 1).flat_map(|y| {
                (x.saturating_sub(1)..=x + 1).filter(|x| *x < width).map(move |x| y * width + x)
            });
            let known: Vec<Vec3> = around.filter_map(|place| texels.get(place).copied().flatten()).collect();
            let mean = || known.iter().sum::<Vec3>() / known.len() as f32;
            texel.or_else(|| (!known.is_empty()).then(mean))
        };
        texels = texels.iter().enumerate().map(filled).collect();
    }
    texels.into_iter().map(Option::unwrap_or_default).collect()
}

#[cfg(test)]
mod tests {
    use lumbre_mesh::shapes;
    use lumbre_scene::{LightmapEncoding, Transform, update_transforms};

    use super::*;

    const SIDE: u32 = 24;

    /// The inside of a cube with sides of 2, whose surface has this diffuse reflectance and this direct light. The
    /// edges of the cube are this many texels inside the borders of its charts.
    fn furnace(reflectance: f32, direct: f32, inside: f32) -> World {
        let mut world = World::new();
        let mut cube = shapes::cuboid(Vec3::splat(2.0), 1);
        // Each side has a third of the map's width and half of its height. Its vertices follow one another.
        cube.uv1 = (0..cube.positions.len())
            .map(|at| {
                let side = at / 4;
                let corner = (inside + cube.uv0[at] * (SIDE as f32 - 2.0 * inside)) / SIDE as f32;
                (Vec2::new((side % 3) as f32, (side / 3) as f32) + corner) / Vec2::new(3.0, 2.0)
            })
            .collect();
        cube.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        cube.normals.iter_mut().for_each(|normal| *normal = -*normal);
        let (width, height) = (3 * SIDE, 2 * SIDE);
        let texels = vec![Vec3::splat(direct); (width * height) as usize];
        let encoding = LightmapEncoding::Rgb32Float;
        let image = LightmapImage { name: "furnace".into(), width, height, texels, encoding };
        world.spawn((
            Mesh(Arc::new(cube)),
            Material::matt(Vec3::splat(reflectance)),
            Transform::IDENTITY,
            StaticObject,
            Lightmap { image: Arc::new(image) },
        ));
        update_transforms(&mut world);
        world
    }

    #[test]
    fn in_a_furnace_each_bounce_brings_the_reflectance_times_the_one_before() {
        let (reflectance, direct) = (0.6, 0.5);
        // With half a texel, the centres of the outermost texels lie on the edges of the cube.
        for inside in [0.0, 0.5] {
            let mut bounces = BounceByBounce::new(&mut furnace(reflectance, direct, inside), 64);
            assert_eq!(bounces.texels(), 6 * (SIDE * SIDE) as usize);
            let (mut sum, mut last) = (direct, direct);
            for bounce in 1..=6 {
                bounces.bounce();
                last *= reflectance;
                sum += last;
                for light in &bounces.arrived {
                    // The furnace is closed, so that every ray hits: only f32 rounds.
                    let apart = (*light - Vec3::splat(sum)).abs().max_element();
                    assert!(apart < 1e-5, "{inside} {bounce}: {light}, not {sum}");
                }
                assert!((bounces.share_of_last() - f64::from(last / sum)).abs() < 1e-5);
            }
        }
        // Negative control: without a reflectance nothing is added.
        let mut black = BounceByBounce::new(&mut furnace(0.0, direct, 0.0), 8);
        black.bounce();
        assert!(black.arrived.iter().all(|light| *light == Vec3::splat(direct)));
    }

    #[test]
    fn directions_are_distributed_by_their_cosine() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let rays = 4096;
        let sum: Vec3 = (0..rays).map(|ray| cosine_direction(normal, ray, rays, 7)).sum();
        // The mean of a cosine distribution is 2/3 of the normal.
        assert!((sum / rays as f32 - normal * (2.0 / 3.0)).length() < 2e-3, "{}", sum / rays as f32);
    }
}
