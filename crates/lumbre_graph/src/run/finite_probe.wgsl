// Finds the first texel, in reading order, that has NaN or Inf. probe.rs substitutes IMAGE and SAMPLES.
//
// A driver may assume that there is no NaN (WGSL 15.7.1) and optimize comparisons away, so the test looks at the
// bits of the exponent: all of them are set in NaN and Inf and in no other value.

struct Found {
    // Row-major index of the texel, or 0xffffffff if there is none.
    first: atomic<u32>,
    sample_index: u32,
    value: vec4<u32>,
}

@group(0) @binding(0) var image: IMAGE;
@group(0) @binding(1) var<storage, read_write> found: Found;

fn is_finite(value: vec4<f32>) -> bool {
    let exponent = vec4<u32>(0x7f800000u);
    return all((bitcast<vec4<u32>>(value) & exponent) != exponent);
}

@compute @workgroup_size(8, 8)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(image);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    for (var index = 0u; index < SAMPLES; index++) {
        if !is_finite(textureLoad(image, id.xy, index)) {
            atomicMin(&found.first, id.y * size.x + id.x);
        }
    }
}

@compute @workgroup_size(1)
fn fetch() {
    let first = atomicLoad(&found.first);
    if first == 0xffffffffu {
        return;
    }
    let width = textureDimensions(image).x;
    let texel = vec2<u32>(first % width, first / width);
    for (var index = 0u; index < SAMPLES; index++) {
        let value = textureLoad(image, texel, index);
        if !is_finite(value) {
            found.sample_index = index;
            found.value = bitcast<vec4<u32>>(value);
            return;
        }
    }
}
