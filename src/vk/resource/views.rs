//! The views of one binding, without a heap allocation where they are few.

use super::image::ImageView;
use std::ops::Deref;

/// Views that need no heap: arrays of resources are rarely longer.
const FEW: usize = 8;

#[derive(Clone)]
pub(in crate::vk) enum Views<'a> {
    /// The first so many of the array; the rest repeats one of them.
    Few([ImageView<'a>; FEW], usize),
    Many(Vec<ImageView<'a>>),
}

impl<'a> Views<'a> {
    pub(in crate::vk) fn of(views: impl IntoIterator<Item = ImageView<'a>>) -> Self {
        let mut views = views.into_iter();
        let Some(first) = views.next() else { return Self::Many(Vec::new()) };
        let (mut few, mut count) = ([first; FEW], 1);
        for view in views.by_ref() {
            if count == FEW {
                return Self::Many(few.into_iter().chain([view]).chain(views).collect());
            }
            few[count] = view;
            count += 1;
        }
        Self::Few(few, count)
    }
}

impl<'a> Deref for Views<'a> {
    type Target = [ImageView<'a>];

    fn deref(&self) -> &[ImageView<'a>] {
        match self {
            Self::Few(views, count) => &views[..*count],
            Self::Many(views) => views,
        }
    }
}
