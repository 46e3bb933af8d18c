//! Values as little-endian bytes. Not the file that they are written to.

use glam::{Vec2, Vec3};

/// Something that a checkpoint keeps. What is read is what was written, to the last bit.
pub(crate) trait Record: Sized {
    /// Fewest bytes of one.
    const LEAST: usize;

    /// Appends its bytes.
    fn write(&self, out: &mut Vec<u8>);

    /// Reads what was written; `None` where the bytes end too early or say what no bake writes.
    fn read(from: &mut Cursor<'_>) -> Option<Self>;
}

/// Bytes to be read from the front.
pub(crate) struct Cursor<'a>(pub &'a [u8]);

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    /// `count` records.
    pub fn list<T: Record>(&mut self, count: u64) -> Option<Vec<T>> {
        // Nothing is allocated that the bytes cannot hold.
        let count = usize::try_from(count).ok()?;
        if count.checked_mul(T::LEAST)? > self.0.len() {
            return None;
        }
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            values.push(T::read(self)?);
        }
        Some(values)
    }
}

macro_rules! number {
    ($($kind:ty),*) => { $(
        impl Record for $kind {
            const LEAST: usize = size_of::<$kind>();

            fn write(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn read(from: &mut Cursor<'_>) -> Option<Self> {
                from.take().map(<$kind>::from_le_bytes)
            }
        }
    )* };
}

number!(u8, u32, u64, f32, f64);

/// A struct by its fields: whoever adds one is asked for it here.
macro_rules! fields {
    ($kind:ident { $($field:ident: $of:ty),* $(,)? }) => {
        impl $crate::checkpoint::Record for $kind {
            const LEAST: usize = 0 $(+ <$of as $crate::checkpoint::Record>::LEAST)*;

            fn write(&self, out: &mut Vec<u8>) {
                let Self { $($field),* } = self;
                $($crate::checkpoint::Record::write($field, out);)*
            }

            fn read(from: &mut $crate::checkpoint::record::Cursor<'_>) -> Option<Self> {
                // In the order in which they are written.
                $(let $field = <$of as $crate::checkpoint::Record>::read(from)?;)*
                Some(Self { $($field),* })
            }
        }
    };
}

pub(crate) use fields;

impl Record for bool {
    const LEAST: usize = 1;

    fn write(&self, out: &mut Vec<u8>) {
        out.push((*self).into());
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        match u8::read(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl Record for Vec2 {
    const LEAST: usize = 8;

    fn write(&self, out: &mut Vec<u8>) {
        self.to_array().iter().for_each(|value| value.write(out));
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        Some(Self::new(Record::read(from)?, Record::read(from)?))
    }
}

impl Record for Vec3 {
    const LEAST: usize = 12;

    fn write(&self, out: &mut Vec<u8>) {
        self.to_array().iter().for_each(|value| value.write(out));
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        Some(Self::new(Record::read(from)?, Record::read(from)?, Record::read(from)?))
    }
}

impl<A: Record, B: Record> Record for (A, B) {
    const LEAST: usize = A::LEAST + B::LEAST;

    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
        self.1.write(out);
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        Some((A::read(from)?, B::read(from)?))
    }
}

impl<T: Record, const N: usize> Record for [T; N] {
    const LEAST: usize = N * T::LEAST;

    fn write(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.write(out));
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        from.list(N as u64)?.try_into().ok()
    }
}

impl<T: Record> Record for Vec<T> {
    const LEAST: usize = 8;

    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u64).write(out);
        self.iter().for_each(|value| value.write(out));
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        let count = u64::read(from)?;
        from.list(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::direct::{Direct, Seen};
    use crate::transport::form_factors::Cast;

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let direct = Direct {
            baked: Vec3::new(1.0, -0.0, f32::MIN_POSITIVE / 2.0),
            mixed: Vec3::new(f32::INFINITY, 3.5, -2.0),
            variance: 0.1,
            caution: 0.05,
            rays: 7,
            sampled: true,
            seen: Seen { partly: true, signature: 0xdead_beef },
        };
        let cast =
            Cast { met: [vec![(1, 2), (3, 4)], vec![]], inside: [5, 6], missed: [7, 8], count: [9, 10] };
        let mut bytes = Vec::new();
        direct.write(&mut bytes);
        assert_eq!(bytes.len(), Direct::LEAST);
        cast.write(&mut bytes);
        let mut cursor = Cursor(&bytes);
        let again = Direct::read(&mut cursor).unwrap();
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        assert_eq!((bits(again.baked), bits(again.mixed)), (bits(direct.baked), bits(direct.mixed)));
        assert_eq!((again.rays, again.sampled, again.seen), (direct.rays, direct.sampled, direct.seen));
        let again = Cast::read(&mut cursor).unwrap();
        assert_eq!((&again.met, again.inside, again.count), (&cast.met, cast.inside, cast.count));
        assert!(cursor.0.is_empty());
        // Whatever is cut off is missed.
        for end in 0..bytes.len() {
            let mut cursor = Cursor(&bytes[..end]);
            assert!(Direct::read(&mut cursor).is_none() || Cast::read(&mut cursor).is_none(), "{end}");
        }
    }

    #[test]
    fn a_count_that_the_bytes_cannot_hold_allocates_nothing() {
        let mut bytes = Vec::new();
        u64::MAX.write(&mut bytes);
        bytes.extend_from_slice(&[0; 64]);
        assert!(Vec::<(u32, u32)>::read(&mut Cursor(&bytes)).is_none());
        assert!(Cursor(&[2]).list::<bool>(1).is_none(), "2 is neither false nor true");
    }
}
