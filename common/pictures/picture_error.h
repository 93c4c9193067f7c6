// How far one picture is from another where it matters: within a mask, as a signal, as structure, and to the
// eye. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

/// 1 per pixel that counts.
using PictureMask = std::vector<uint8_t>;

/// Pixels where the picture differs from the one without its subject by more than the least step of a colour.
PictureMask mask_of(const Image& picture, const Image& without_subject);

struct PictureError {
  double psnr_db = 0.0;       // of red, green and blue; 99 where there is no difference
  double ssim = 1.0;          // mean over blocks of 8 x 8 of luma, K1 0.01, K2 0.03 (Wang et al. 2004)
  double delta_e = 0.0;       // mean distance in CIE L*a*b* after a mean over 3 x 3 pixels: 1 is just seen
  double masked_share = 0.0;  // of the picture
};

/// BadInput for pictures and masks of different sizes and an empty mask.
Result<PictureError> picture_error(const Image& seen, const Image& truth, const PictureMask& mask);

/// A picture whose sides are a multiple of `factor`, as the mean of the light of factor x factor pixels.
Image shrunk(const Image& image, uint32_t factor);

}  // namespace strandcast
