//! Indices (appendix A, modes 1 and 2): of triangles that share edges with recent ones, and in any order.

use super::{Damage, Stream};

const UNWRITTEN: Damage = "name a recent edge or vertex before there is one";

/// The latest 16 values.
struct Fifo<T> {
    values: [T; 16],
    /// How many there have ever been.
    pushed: usize,
}

impl<T: Copy + Default> Fifo<T> {
    fn new() -> Self {
        Self { values: [T::default(); 16], pushed: 0 }
    }

    fn push(&mut self, value: T) {
        self.values[self.pushed % 16] = value;
        self.pushed += 1;
    }

    /// 0 is the latest.
    fn get(&self, age: u8) -> Result<T, Damage> {
        let at = self.pushed.checked_sub(1 + usize::from(age)).ok_or(UNWRITTEN)?;
        Ok(self.values[at % 16])
    }
}

/// The state between triangles.
struct Triangles<'a> {
    data: Stream<'a>,
    edges: Fifo<[u32; 2]>,
    vertices: Fifo<u32>,
    /// The vertex after the highest one.
    next: u32,
    /// The latest vertex that was written as a difference.
    last: u32,
}

/// `count` indices of `stride` bytes, 2 or 4: three for each triangle.
pub fn triangles(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damage> {
    let mut stream = Stream(bytes);
    if stream.byte()? != 0xe1 {
        return Err("are of an unknown version");
    }
    let table: &[u8; 16] = stream.tail(16)?.try_into().map_err(|_| super::ENDS_EARLY)?;
    let codes = stream.take(count / 3)?;
    let mut state = Triangles { data: stream, edges: Fifo::new(), vertices: Fifo::new(), next: 0, last: 0 };
    let mut out = Vec::with_capacity(count * stride);
    for &code in codes {
        let triangle = if code < 0xf0 { state.at_edge(code)? } else { state.apart(code, table)? };
        triangle.into_iter().for_each(|index| out.extend_from_slice(&index.to_le_bytes()[..stride]));
    }
    state.data.end()?;
    Ok(out)
}

impl Triangles<'_> {
    /// A triangle at a recent edge.
    fn at_edge(&mut self, code: u8) -> Result<[u32; 3], Damage> {
        let [a, b] = self.edges.get(code >> 4)?;
        let third = code & 15;
        let c = match third {
            0 => self.take_next(),
            1..0xd => self.vertices.get(third)?,
            0xf => self.difference()?,
            _ => {
                let step = if third == 0xd { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                self.last
            }
        };
        if !(1..0xd).contains(&third) {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    /// A triangle that shares no recent edge. Codes below 0xfe find in the table where its vertices are; other codes are
    /// followed by that byte.
    fn apart(&mut self, code: u8, table: &[u8; 16]) -> Result<[u32; 3], Damage> {
        let places = if code < 0xfe { table[usize::from(code & 15)] } else { self.data.byte()? };
        let (second, third) = (places >> 4, places & 15);
        if code < 0xfe && (second == 15 || third == 15) {
            return Err("have a table that the format excludes");
        }
        if code >= 0xfe && places == 0 {
            self.next = 0;
        }
        let a = if code == 0xff { self.difference()? } else { self.take_next() };
        let b = self.vertex(second)?;
        let c = self.vertex(third)?;
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        self.vertices.push(a);
        for (vertex, place) in [(b, second), (c, third)] {
            if place == 0 || place == 15 {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }

    /// The vertex at a place: the next one, a recent one, or one that is written as a difference.
    fn vertex(&mut self, place: u8) -> Result<u32, Damage> {
        match place {
            0 => Ok(self.take_next()),
            15 => self.difference(),
            _ => self.vertices.get(place - 1),
        }
    }

    fn take_next(&mut self) -> u32 {
        let vertex = self.next;
        self.next = self.next.wrapping_add(1);
        vertex
    }

    fn difference(&mut self) -> Result<u32, Damage> {
        self.last = self.last.wrapping_add(signed(number(&mut self.data)?));
        Ok(self.last)
    }
}

/// `count` indices of `stride` bytes, 2 or 4, in any order: differences from one of two indices before.
pub fn sequence(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damage> {
    let mut stream = Stream(bytes);
    if stream.byte()? != 0xd1 {
        return Err("are of an unknown version");
    }
    stream.tail(4)?;
    let mut last = [0u32; 2];
    let mut out = Vec::new();
    for _ in 0..count {
        let value = number(&mut stream)?;
        let last = &mut last[value as usize & 1];
        *last = last.wrapping_add(signed(value >> 1));
        out.extend_from_slice(&last.to_le_bytes()[..stride]);
    }
    stream.end()?;
    Ok(out)
}

/// Seven bits a byte, the lowest first; the eighth says that more follow. Bits beyond the 32nd are ignored.
fn number(stream: &mut Stream) -> Result<u32, Damage> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = stream.byte()?;
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Err("have a number of more than 32 bits")
}

/// The lowest bit is the sign.
fn signed(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}
