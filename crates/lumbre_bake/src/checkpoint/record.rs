//! Values as bytes, in the format of postcard: numbers keep every bit, and lists are preceded by their lengths. Not the
//! file that the bytes are written to.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A value that a checkpoint can keep. It is read exactly as it was written, to the last bit.
pub(crate) trait Record: Serialize + DeserializeOwned {}

impl<T: Serialize + DeserializeOwned> Record for T {}

/// The bytes of a value.
///
/// # Errors
/// None for what this crate writes: every list knows its length.
pub(crate) fn written(value: &impl Serialize) -> Result<Vec<u8>, postcard::Error> {
    postcard::to_stdvec(value)
}

/// The value that all of these bytes together encode; `None` if they are too few, too many, or not what a bake writes.
/// Never allocates more than they can hold.
pub(crate) fn read<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    rest.is_empty().then_some(value)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::radiosity::PatchIndex;
    use crate::radiosity::ray_counts::PatchRayCounts;
    use crate::sources::{Direct, VisibilitySummary};

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let direct = Direct {
            baked: Vec3::new(1.0, -0.0, f32::MIN_POSITIVE / 2.0),
            mixed: Vec3::new(f32::INFINITY, f32::from_bits(0x7fc0_1234), -2.0),
            variance: 0.1,
            caution: 0.05,
            rays: 7,
            samples_without_ray: 3,
            sampled: true,
            seen: VisibilitySummary { partly: true, signature: 0xdead_beef },
        };
        let cast = PatchRayCounts {
            hits: [vec![(PatchIndex(1), 2), (PatchIndex(3), u32::MAX)], vec![]],
            inside: [5, 6],
            missed: [7, 8],
            count: [9, 10],
        };
        let bytes = written(&(direct, cast.clone())).unwrap();
        let (again, cast_again): (Direct, PatchRayCounts) = read(&bytes).unwrap();
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        assert_eq!((bits(again.baked), bits(again.mixed)), (bits(direct.baked), bits(direct.mixed)));
        assert_eq!((again.rays, again.samples_without_ray), (direct.rays, direct.samples_without_ray));
        assert_eq!((again.sampled, again.seen), (direct.sampled, direct.seen));
        assert_eq!((&cast_again.hits, cast_again.inside), (&cast.hits, cast.inside));
        assert_eq!((cast_again.missed, cast_again.count), (cast.missed, cast.count));
        // Bytes that are missing or left over are noticed.
        for end in 0..bytes.len() {
            assert!(read::<(Direct, PatchRayCounts)>(&bytes[..end]).is_none(), "{end}");
        }
        assert!(read::<(Direct, PatchRayCounts)>(&[bytes, vec![0]].concat()).is_none());
    }

    #[test]
    fn a_count_that_the_bytes_cannot_hold_allocates_nothing() {
        let mut bytes = written(&u64::MAX).unwrap();
        bytes.extend_from_slice(&[0; 64]);
        assert!(read::<Vec<(u32, u32)>>(&bytes).is_none());
        assert!(read::<bool>(&[2]).is_none(), "2 is neither false nor true");
    }
}
