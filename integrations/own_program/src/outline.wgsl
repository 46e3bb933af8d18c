// Outlines: the shapes of chosen objects, each in its colour, and a rim around them.

struct Object {
    clip_from_mesh: mat4x4<f32>,
    color: vec4<f32>,
}

@group(0) @binding(0) var<uniform> object: Object;

@vertex
fn shape_vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    return object.clip_from_mesh * vec4<f32>(position, 1.0);
}

@fragment
fn shape() -> @location(0) vec4<f32> {
    return vec4<f32>(object.color.rgb, 1.0);
}

@group(0) @binding(0) var shapes: texture_2d<f32>;
@group(0) @binding(1) var<uniform> width: vec4<f32>;

@vertex
fn rim_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0);
}

// The colour of the nearest shape, where a pixel is outside of all and nearer than the width to one.
@fragment
fn rim(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let last = vec2<i32>(textureDimensions(shapes)) - 1;
    if textureLoad(shapes, pixel, 0).a > 0.5 {
        discard;
    }
    let reach = i32(ceil(width.x));
    var nearest = width.x * width.x;
    var color = vec4<f32>(0.0);
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let offset = vec2<i32>(x, y);
            let near = textureLoad(shapes, clamp(pixel + offset, vec2<i32>(0), last), 0);
            let distance = f32(dot(offset, offset));
            if near.a > 0.5 && distance <= nearest {
                nearest = distance;
                color = near;
            }
        }
    }
    if color.a == 0.0 {
        discard;
    }
    return color;
}
