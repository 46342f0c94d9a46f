//! Packs the words of all shaders for the program. The build includes this file; `unpack.rs` is its other half.
//!
//! Forms of a shader have most of their functions in common, further apart than deflate looks back. So runs of words
//! that stood before are taken out first, each replaced by its length and its place; the rest is deflated.

/// A shorter run, in words, would save less than it takes.
const LEAST_RUN: usize = 6;
/// Of the table of places.
const HASH_BITS: u32 = 20;

/// A run of words that stands before: it follows on `fresh` words that do not.
struct Run {
    fresh: usize,
    length: usize,
    place: usize,
}

/// `words` in fewer bytes: of the number of runs, then of the members of all runs, member by member, then of the fresh
/// words, the first bytes of all, their second bytes and so on, deflated.
pub fn pack(words: &[u32]) -> Vec<u8> {
    let (mut runs, mut fresh) = (Vec::new(), Vec::new());
    // One past the place where words of this hash stood last.
    let mut places = vec![0; 1 << HASH_BITS];
    let (mut at, mut copied) = (0, 0);
    while at + LEAST_RUN <= words.len() {
        let before = std::mem::replace(&mut places[hash(&words[at..at + LEAST_RUN])], at as u32 + 1) as usize;
        let same = || words[before - 1..].iter().zip(&words[at..]).take_while(|(a, b)| a == b).count();
        let length = if before > 0 { same() } else { 0 };
        if length >= LEAST_RUN {
            runs.push(Run { fresh: at - copied, length, place: before - 1 });
            fresh.extend_from_slice(&words[copied..at]);
            at += length;
            copied = at;
        } else {
            at += 1;
        }
    }
    fresh.extend_from_slice(&words[copied..]);
    let members: [fn(&Run) -> usize; 3] = [|run| run.fresh, |run| run.length, |run| run.place];
    let mut all = vec![runs.len() as u32];
    members.iter().for_each(|member| all.extend(runs.iter().map(|run| member(run) as u32)));
    all.extend(fresh);
    let bytes: Vec<u8> = (0..4).flat_map(|place| all.iter().map(move |word| word.to_le_bytes()[place])).collect();
    miniz_oxide::deflate::compress_to_vec(&bytes, 6)
}

fn hash(words: &[u32]) -> usize {
    const ODD: u32 = 0x9e37_79b1;
    let mixed = words.iter().fold(0u32, |mixed, word| (mixed.rotate_left(5) ^ word).wrapping_mul(ODD));
    (mixed >> (32 - HASH_BITS)) as usize
}
