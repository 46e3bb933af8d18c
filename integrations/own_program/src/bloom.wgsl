// A pyramid of halved frames (Burt and Adelson, "The Laplacian pyramid as a compact image code", 1983): bright places spread over their surroundings.

@group(0) @binding(0) var fine: texture_2d<f32>;
@group(0) @binding(1) var coarse: texture_2d<f32>;
@group(0) @binding(2) var<uniform> strength: vec4<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0);
}

fn load(image: texture_2d<f32>, texel: vec2<i32>) -> vec3<f32> {
    let last = vec2<i32>(textureDimensions(image)) - 1;
    return textureLoad(image, clamp(texel, vec2<i32>(0), last), 0).rgb;
}

// Four by four texels with the weights 1 3 3 1 along each side.
@fragment
fn downsample(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let corner = 2 * vec2<i32>(position.xy) - 1;
    var sum = vec3<f32>(0.0);
    for (var y = 0; y < 4; y++) {
        for (var x = 0; x < 4; x++) {
            let weight = f32((1 + 2 * i32(x == 1 || x == 2)) * (1 + 2 * i32(y == 1 || y == 2)));
            sum += weight * load(fine, corner + vec2<i32>(x, y));
        }
    }
    return vec4<f32>(sum / 64.0, 1.0);
}

// The coarser level between its four nearest texels.
fn enlarged(position: vec2<f32>) -> vec3<f32> {
    let place = 0.5 * position - 0.5;
    let corner = floor(place);
    let part = place - corner;
    let texel = vec2<i32>(corner);
    let top = mix(load(coarse, texel), load(coarse, texel + vec2<i32>(1, 0)), part.x);
    let bottom = mix(load(coarse, texel + vec2<i32>(0, 1)), load(coarse, texel + vec2<i32>(1, 1)), part.x);
    return mix(top, bottom, part.y);
}

// The mean of a level and of what the coarser ones have spread.
@fragment
fn upsample(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(0.5 * (load(fine, vec2<i32>(position.xy)) + enlarged(position.xy)), 1.0);
}

@fragment
fn compose(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let lit = textureLoad(fine, vec2<i32>(position.xy), 0);
    return vec4<f32>(mix(lit.rgb, enlarged(position.xy), strength.x), lit.a);
}
