// Checks shared by the picture writers and readers. Private to common/pictures.
#pragma once

#include "common/pictures/image_codec.h"

namespace strandcast {

/// Returns BadInput for empty images and for sizes that disagree, LimitExceeded above kMaxImageSide.
Status check_image(const Image& image);
Status check_image_size(uint64_t width, uint64_t height);
/// Returns LimitExceeded outside the sizes of picture_size.h.
Status check_picture_size(uint64_t width, uint64_t height);

}  // namespace strandcast
