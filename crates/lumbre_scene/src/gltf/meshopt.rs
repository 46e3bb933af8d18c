//! Decodes the data of EXT_meshopt_compression: vertices, triangles, index sequences, and the filters for
//! vertices. Implemented after appendices A and B of the extension's specification.
//!
//! Every read is bounds-checked, and the caller limits the decoded size before anything is allocated.

/// The kind of data in a compressed buffer view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// The filter that converts decoded attributes to numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

const TRUNCATED: &str = "its compressed data end too early";
const LEFT_OVER: &str = "its compressed data have another length than what is in them";

/// Number of elements in a group, which are coded with the same number of bits.
const GROUP: usize = 16;
/// Largest number of bytes and of elements in a block.
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;
/// Smallest number of bytes after the last block.
const TAIL: usize = 32;

/// Reads bytes from the front.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn byte(&mut self) -> Result<u8, &'static str> {
        self.take(1).map(|bytes| bytes[0])
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], &'static str> {
        let end = self.at.checked_add(count).ok_or(TRUNCATED)?;
        let taken = self.bytes.get(self.at..end).ok_or(TRUNCATED)?;
        self.at = end;
        Ok(taken)
    }

    /// Reads an unsigned number of at most 32 bits in LEB128: groups of seven bits, the lowest first.
    fn leb128(&mut self) -> Result<u32, &'static str> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f).checked_shl(shift).unwrap_or_default();
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number in its compressed data has more than 32 bits")
    }
}

/// Decodes `count` elements of `stride` bytes.
///
/// # Errors
/// A description of what is wrong with the data.
pub(crate) fn decode(
    mode: Mode,
    filter: Filter,
    count: usize,
    stride: usize,
    source: &[u8],
) -> Result<Vec<u8>, &'static str> {
    let indices = matches!(stride, 2 | 4);
    match mode {
        Mode::Attributes if stride == 0 || !stride.is_multiple_of(4) || stride > 256 => {
            Err("its byteStride has to be a multiple of 4 up to 256")
        }
        Mode::Attributes => {
            let mut data = vertices(count, stride, source)?;
            apply(filter, stride, &mut data)?;
            Ok(data)
        }
        _ if !indices => Err("its byteStride has to be 2 or 4 for indices"),
        _ if filter != Filter::None => Err("it has a filter, which only attributes may have"),
        Mode::Triangles if !count.is_multiple_of(3) => Err("its count of indices is no multiple of 3"),
        Mode::Triangles => Ok(as_bytes(&triangles(count, source)?, stride)),
        Mode::Indices => Ok(as_bytes(&sequence(count, source)?, stride)),
    }
}

fn as_bytes(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}

/// (v & 1) ? !(v >> 1) : v >> 1
fn unzigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn vertices(count: usize, stride: usize, source: &[u8]) -> Result<Vec<u8>, &'static str> {
    match source.first() {
        Some(0xa0) => {}
        Some(0xa1) => {
            return Err(
                "it is of version 1 of the codec, which the extension does not have; compress it again",
            );
        }
        _ => return Err("it does not begin as compressed attributes do"),
    }
    let tail = source.len().checked_sub(stride).filter(|&tail| tail > 0).ok_or(TRUNCATED)?;
    let (body, last) = source.split_at(tail);
    let mut last = last.to_vec();
    let mut reader = Reader { bytes: body, at: 1 };
    let mut data = Vec::with_capacity(count * stride);
    let most = ((BLOCK_BYTES / stride) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
    let mut deltas = vec![[0u8; BLOCK_ELEMENTS]; stride];
    while data.len() < count * stride {
        let elements = (count - data.len() / stride).min(most);
        for own in &mut deltas {
            let groups = elements.div_ceil(GROUP);
            let headers = reader.take(groups.div_ceil(4))?;
            for group in 0..groups {
                let mode = headers[group / 4] >> (2 * (group % 4)) & 3;
                let values = &mut own[group * GROUP..][..GROUP];
                read_group(&mut reader, mode, values)?;
            }
        }
        for element in 0..elements {
            for (byte, own) in last.iter_mut().zip(&deltas) {
                *byte = byte.wrapping_add(unzigzag(u32::from(own[element])) as u8);
            }
            data.extend_from_slice(&last);
        }
    }
    // The tail is padded to 32 bytes.
    if reader.at + TAIL.saturating_sub(stride) == body.len() { Ok(data) } else { Err(LEFT_OVER) }
}

/// Reads sixteen numbers of 0, 2, 4 or 8 bits. With 2 or 4 bits, the largest value means that a full byte
/// follows.
fn read_group(reader: &mut Reader<'_>, mode: u8, values: &mut [u8]) -> Result<(), &'static str> {
    let bits = match mode {
        0 => {
            values.fill(0);
            return Ok(());
        }
        3 => {
            values.copy_from_slice(reader.take(GROUP)?);
            return Ok(());
        }
        mode => 2 * u32::from(mode),
    };
    let escape = (1u8 << bits) - 1;
    let in_byte = 8 / bits as usize;
    let packed = reader.take(GROUP / in_byte)?;
    for (index, value) in values.iter_mut().enumerate() {
        let shift = 8 - bits * (1 + (index % in_byte) as u32);
        let own = packed[index / in_byte] >> shift & escape;
        *value = if own == escape { reader.byte()? } else { own };
    }
    Ok(())
}

/// A ring buffer of the most recent values.
struct Recent<const N: usize, T> {
    values: [T; N],
    next: usize,
}

impl<const N: usize, T: Copy + Default> Recent<N, T> {
    fn new() -> Self {
        Self { values: [T::default(); N], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.values[self.next] = value;
        self.next = (self.next + 1) % N;
    }

    /// The value pushed `back` steps before the latest one.
    fn get(&self, back: usize) -> T {
        self.values[(self.next + N - 1 - back % N) % N]
    }
}

fn triangles(count: usize, source: &[u8]) -> Result<Vec<u32>, &'static str> {
    if source.first() != Some(&0xe1) {
        return Err("it does not begin as compressed triangles do");
    }
    let body = source.len().checked_sub(16).ok_or(TRUNCATED)?;
    let (body, table) = source.split_at(body);
    let codes = body.get(1..1 + count / 3).ok_or(TRUNCATED)?;
    let mut reader = Reader { bytes: body, at: 1 + count / 3 };
    let mut edges = Recent::<16, (u32, u32)>::new();
    let mut vertices = Recent::<16, u32>::new();
    let (mut next, mut last) = (0u32, 0u32);
    let fresh = |next: &mut u32| {
        let own = *next;
        *next = next.wrapping_add(1);
        own
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        let (high, low) = (usize::from(code >> 4), usize::from(code & 15));
        if high < 15 {
            let (a, b) = edges.get(high);
            let c = match low {
                0 => fresh(&mut next),
                1..=12 => vertices.get(low),
                13 => {
                    last = last.wrapping_sub(1);
                    last
                }
                14 => {
                    last = last.wrapping_add(1);
                    last
                }
                _ => {
                    last = last.wrapping_add(unzigzag(reader.leb128()?));
                    last
                }
            };
            if !(1..=12).contains(&low) {
                vertices.push(c);
            }
            edges.push((c, b));
            edges.push((a, c));
            indices.extend([a, b, c]);
            continue;
        }
        let pair = if low < 14 { table[low] } else { reader.byte()? };
        if low >= 14 && pair == 0 {
            next = 0;
        }
        let mut free = |kind: u8, next: &mut u32, vertices: &Recent<16, u32>| match kind {
            0 => Ok(fresh(next)),
            15 if low >= 14 => {
                last = last.wrapping_add(unzigzag(reader.leb128()?));
                Ok(last)
            }
            back => Ok(vertices.get(usize::from(back) - 1)),
        };
        let a = free(if low == 15 { 15 } else { 0 }, &mut next, &vertices)?;
        let (second, third) = (pair >> 4, pair & 15);
        let b = free(second, &mut next, &vertices)?;
        let c = free(third, &mut next, &vertices)?;
        vertices.push(a);
        for (kind, vertex) in [(second, b), (third, c)] {
            if kind == 0 || kind == 15 && low >= 14 {
                vertices.push(vertex);
            }
        }
        edges.push((b, a));
        edges.push((c, b));
        edges.push((a, c));
        indices.extend([a, b, c]);
    }
    if reader.at == body.len() { Ok(indices) } else { Err(LEFT_OVER) }
}

fn sequence(count: usize, source: &[u8]) -> Result<Vec<u32>, &'static str> {
    if source.first() != Some(&0xd1) {
        return Err("it does not begin as compressed indices do");
    }
    let body = source.len().checked_sub(4).ok_or(TRUNCATED)?;
    let mut reader = Reader { bytes: &source[..body], at: 1 };
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let value = reader.leb128()?;
        let own = &mut last[(value & 1) as usize];
        *own = own.wrapping_add(unzigzag(value >> 1));
        indices.push(*own);
    }
    if reader.at == body { Ok(indices) } else { Err(LEFT_OVER) }
}

fn apply(filter: Filter, stride: usize, data: &mut [u8]) -> Result<(), &'static str> {
    match filter {
        Filter::None => {}
        Filter::Octahedral if stride == 4 => {
            for element in data.chunks_exact_mut(4) {
                let [x, y, one] = [element[0], element[1], element[2]].map(|byte| f32::from(byte as i8));
                let unit = octahedral(x, y, one, 127.0);
                for (byte, value) in element.iter_mut().zip(unit) {
                    *byte = value as i8 as u8;
                }
            }
        }
        Filter::Octahedral if stride == 8 => {
            for element in data.chunks_exact_mut(8) {
                let [x, y, one] =
                    [0, 2, 4].map(|at| f32::from(i16::from_le_bytes([element[at], element[at + 1]])));
                let unit = octahedral(x, y, one, 32767.0);
                for (bytes, value) in element.chunks_exact_mut(2).zip(unit) {
                    bytes.copy_from_slice(&(value as i16).to_le_bytes());
                }
            }
        }
        Filter::Quaternion if stride == 8 => {
            for element in data.chunks_exact_mut(8) {
                let word = |at: usize| i16::from_le_bytes([element[2 * at], element[2 * at + 1]]);
                let largest = usize::from(word(3) as u16 & 3);
                let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(word(3) | 3);
                let [x, y, z] = [0, 1, 2].map(|at| f32::from(word(at)) * scale);
                let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
                for (at, value) in [(1, x), (2, y), (3, z), (0, w)] {
                    let at = 2 * ((largest + at) % 4);
                    element[at..at + 2].copy_from_slice(&(rounded(value * 32767.0) as i16).to_le_bytes());
                }
            }
        }
        Filter::Exponential => {
            for bytes in data.chunks_exact_mut(4) {
                let word = i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                let (exponent, mantissa) = (word >> 24, word << 8 >> 8);
                let value = f64::from(mantissa) * f64::from(exponent).exp2();
                bytes.copy_from_slice(&(value as f32).to_le_bytes());
            }
        }
        Filter::Octahedral | Filter::Quaternion => return Err("its filter does not go with its byteStride"),
    }
    Ok(())
}

/// Decodes an octahedral unit vector, scaled by `most`.
fn octahedral(x: f32, y: f32, one: f32, most: f32) -> [f32; 3] {
    let (x, y) = if one == 0.0 { (0.0, 0.0) } else { (x / one, y / one) };
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = most / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|value| rounded(value * scale))
}

/// Rounds to the nearest integer, halves away from zero.
fn rounded(value: f32) -> f32 {
    value.round()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that data made by meshoptimizer's own encoder decodes as expected, and that no prefix of it
    /// decodes. The vectors are from the tests of its decoder (js/meshopt_decoder.test.js, MIT licence).
    fn holds(mode: Mode, filter: Filter, count: usize, stride: usize, encoded: &[u8], expected: &[u8]) {
        assert_eq!(decode(mode, filter, count, stride, encoded).as_deref(), Ok(expected));
        for length in 0..encoded.len() {
            assert!(
                decode(mode, filter, count, stride, &encoded[..length]).is_err(),
                "cut to {length} bytes"
            );
        }
    }

    #[test]
    fn known_vertices() {
        holds(
            Mode::Attributes,
            Filter::None,
            4,
            12,
            &[
                0xa0, 0x01, 0x3f, 0x00, 0x00, 0x00, 0x58, 0x57, 0x58, 0x01, 0x26, 0x00, 0x00, 0x00, 0x01,
                0x0c, 0x00, 0x00, 0x00, 0x58, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01,
                0x3f, 0x00, 0x00, 0x00, 0x17, 0x18, 0x17, 0x01, 0x26, 0x00, 0x00, 0x00, 0x01, 0x0c, 0x00,
                0x00, 0x00, 0x17, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
            ],
            &[
                0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 44, 1, 0, 0, 0, 0, 0, 0, 244, 1, 0, 0, 0, 0, 44, 1, 0, 0,
                0, 0, 0, 0, 244, 1, 44, 1, 44, 1, 0, 0, 0, 0, 244, 1, 244, 1,
            ],
        );
        holds(
            Mode::Attributes,
            Filter::None,
            16,
            4,
            &[
                0xa0, 0x00, 0x01, 0x2a, 0xaa, 0xaa, 0xaa, 0x02, 0x04, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44,
                0x44, 0x03, 0x00, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10,
                0x10, 0x10, 0x10, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00,
            ],
            &[
                0, 0, 0, 0, 0, 1, 2, 8, 0, 2, 4, 16, 0, 3, 6, 24, 0, 4, 8, 32, 0, 5, 10, 40, 0, 6, 12, 48, 0,
                7, 14, 56, 0, 8, 16, 64, 0, 9, 18, 72, 0, 10, 20, 80, 0, 11, 22, 88, 0, 12, 24, 96, 0, 13,
                26, 104, 0, 14, 28, 112, 0, 15, 30, 120,
            ],
        );
        holds(
            Mode::Attributes,
            Filter::None,
            16,
            4,
            &[
                0xa0, 0x02, 0x08, 0x88, 0x88, 0x88, 0x88, 0x88, 0x88, 0x88, 0x02, 0x0a, 0xaa, 0xaa, 0xaa,
                0xaa, 0xaa, 0xaa, 0xaa, 0x02, 0x0c, 0xcc, 0xcc, 0xcc, 0xcc, 0xcc, 0xcc, 0xcc, 0x02, 0x0e,
                0xee, 0xee, 0xee, 0xee, 0xee, 0xee, 0xee, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
            ],
            &[
                0, 0, 0, 0, 4, 5, 6, 7, 8, 10, 12, 14, 12, 15, 18, 21, 16, 20, 24, 28, 20, 25, 30, 35, 24,
                30, 36, 42, 28, 35, 42, 49, 32, 40, 48, 56, 36, 45, 54, 63, 40, 50, 60, 70, 44, 55, 66, 77,
                48, 60, 72, 84, 52, 65, 78, 91, 56, 70, 84, 98, 60, 75, 90, 105,
            ],
        );
    }

    #[test]
    fn known_indices() {
        let words =
            |indices: &[u32]| -> Vec<u8> { indices.iter().flat_map(|index| index.to_le_bytes()).collect() };
        holds(
            Mode::Triangles,
            Filter::None,
            15,
            4,
            &[
                0xe1, 0xf0, 0x10, 0xfe, 0x1f, 0x3d, 0x00, 0x0a, 0x00, 0x76, 0x87, 0x56, 0x67, 0x78, 0xa9,
                0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
            ],
            &words(&[0, 1, 2, 2, 1, 3, 0, 1, 2, 2, 1, 5, 2, 1, 4]),
        );
        holds(
            Mode::Triangles,
            Filter::None,
            12,
            4,
            &[
                0xe1, 0xf0, 0x10, 0xfe, 0xff, 0xf0, 0x0c, 0xff, 0x02, 0x02, 0x02, 0x00, 0x76, 0x87, 0x56,
                0x67, 0x78, 0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
            ],
            &words(&[0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9]),
        );
        holds(
            Mode::Triangles,
            Filter::None,
            12,
            4,
            &[
                0xe1, 0xf0, 0x20, 0x30, 0x40, 0x00, 0x76, 0x87, 0x56, 0x67, 0x78, 0xa9, 0x86, 0x65, 0x89,
                0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
            ],
            &words(&[0, 1, 2, 1, 0, 3, 2, 1, 4, 0, 2, 5]),
        );
        holds(
            Mode::Indices,
            Filter::None,
            6,
            4,
            &[0xd1, 0x00, 0x04, 0xcd, 0x01, 0x04, 0x07, 0x98, 0x1f, 0x00, 0x00, 0x00, 0x00],
            &words(&[0, 1, 51, 2, 49, 1000]),
        );
    }

    #[test]
    fn known_filters() {
        let words =
            |values: &[u16]| -> Vec<u8> { values.iter().flat_map(|value| value.to_le_bytes()).collect() };
        let floats =
            |values: &[u32]| -> Vec<u8> { values.iter().flat_map(|value| value.to_le_bytes()).collect() };
        holds(
            Mode::Attributes,
            Filter::Octahedral,
            4,
            4,
            &[
                0xa0, 0x01, 0x07, 0x00, 0x00, 0x00, 0x1e, 0x01, 0x3f, 0x00, 0x00, 0x00, 0x8b, 0x8c, 0xfd,
                0x00, 0x01, 0x26, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x7f, 0x00,
            ],
            &[0, 1, 127, 0, 0, 159, 82, 1, 255, 1, 127, 0, 1, 130, 241, 1],
        );
        holds(
            Mode::Attributes,
            Filter::Octahedral,
            4,
            8,
            &[
                0xa0, 0x01, 0x0f, 0x00, 0x00, 0x00, 0x3d, 0x5a, 0x01, 0x0f, 0x00, 0x00, 0x00, 0x0e, 0x0d,
                0x01, 0x3f, 0x00, 0x00, 0x00, 0x9a, 0x99, 0x26, 0x01, 0x3f, 0x00, 0x00, 0x00, 0x0e, 0x0d,
                0x0a, 0x00, 0x00, 0x01, 0x26, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0xff, 0x07, 0x00, 0x00,
            ],
            &words(&[0, 16, 32767, 0, 0, 32621, 3088, 1, 32764, 16, 471, 0, 307, 28541, 16093, 1]),
        );
        holds(
            Mode::Attributes,
            Filter::Quaternion,
            4,
            8,
            &[
                0xa0, 0x01, 0x0f, 0x00, 0x00, 0x00, 0x3d, 0x5a, 0x01, 0x0f, 0x00, 0x00, 0x00, 0x0e, 0x0d,
                0x01, 0x3f, 0x00, 0x00, 0x00, 0x9a, 0x99, 0x26, 0x01, 0x3f, 0x00, 0x00, 0x00, 0x0e, 0x0d,
                0x0a, 0x00, 0x00, 0x01, 0x2a, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0xfc, 0x07,
            ],
            &words(&[32767, 0, 11, 0, 0, 25013, 0, 21166, 11, 0, 23504, 22830, 158, 14715, 0, 29277]),
        );
        holds(
            Mode::Attributes,
            Filter::Exponential,
            1,
            16,
            &[
                0xa0, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0x00, 0x00, 0xff, 0xf7, 0xff, 0xff, 0x02,
                0xff, 0xff, 0x7f, 0xfe,
            ],
            &floats(&[0, 0x3fc00000, 0xc2100000, 0x49fffffe]),
        );
        assert!(apply(Filter::Quaternion, 4, &mut [0; 4]).is_err());
    }

    #[test]
    fn no_mutant_panics() {
        let mut random = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = || {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            random
        };
        let starts: [(Mode, usize, usize, u8); 3] =
            [(Mode::Attributes, 70, 16, 0xa0), (Mode::Triangles, 60, 4, 0xe1), (Mode::Indices, 60, 2, 0xd1)];
        let filters = [Filter::None, Filter::Octahedral, Filter::Quaternion, Filter::Exponential];
        let mut decoded = 0;
        for round in 0..30_000 {
            let (mode, count, stride, first) = starts[round % 3];
            let length = 1 + next() as usize % 400;
            let mut source: Vec<u8> =
                (0..length).map(|_| (next() & if round % 2 == 0 { 0x0f } else { 0xff }) as u8).collect();
            source[0] = first;
            let filter = filters[next() as usize % 4];
            let (count, stride) =
                (count + next() as usize % 9, if next() % 4 == 0 { next() as usize % 9 } else { stride });
            if let Ok(data) = decode(mode, filter, count, stride, &source) {
                assert_eq!(data.len(), count * stride);
                decoded += 1;
            }
        }
        println!("30,000 mutants, {decoded} of them decoded");
    }
}
