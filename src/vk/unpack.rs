//! Unpacks what `pack.rs` packed.

use zune_inflate::DeflateDecoder;

/// The words that were packed.
pub(super) fn unpack(packed: &[u8]) -> Vec<u32> {
    let bytes = DeflateDecoder::new(packed).decode_deflate().expect("the build packed it");
    let count = bytes.len() / 4;
    let mut all = (0..count).map(|i| u32::from_le_bytes([0, 1, 2, 3].map(|place| bytes[place * count + i])));
    let runs = all.next().map_or(0, |runs| runs as usize);
    let mut member = || all.by_ref().take(runs).map(|number| number as usize).collect::<Vec<_>>();
    let (fresh, lengths, places) = (member(), member(), member());
    let mut words = Vec::with_capacity(count + lengths.iter().sum::<usize>());
    for ((fresh, length), place) in fresh.into_iter().zip(lengths).zip(places) {
        words.extend(all.by_ref().take(fresh));
        // A run may begin before the words that it reads from are all there.
        (place..place + length).for_each(|from| words.push(words[from]));
    }
    words.extend(all);
    words
}

#[cfg(test)]
#[path = "pack.rs"]
mod pack;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_words_come_back() {
        let counted: Vec<u32> = (0..1000).collect();
        let repeated = [&counted[..], &counted[100..900], &[7; 50], &counted[..], &[1, 2]].concat();
        for words in [&[][..], &[5], &[9; 40], &counted, &repeated] {
            assert_eq!(unpack(&pack::pack(words)), words);
        }
        assert!(
            pack::pack(&repeated).len() < pack::pack(&counted).len() + 100,
            "a run that stood before takes almost nothing"
        );
    }
}
