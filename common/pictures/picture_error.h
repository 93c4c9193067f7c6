// Compares pictures within a mask: as signals, by structure, and as the eye sees them. Pure functions, any
// thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

/// One value per pixel: 1 = the pixel counts.
using PictureMask = std::vector<uint8_t>;

/// Marks the pixels where the picture differs from one without its subject by more than one step of a colour.
PictureMask mask_of(const Image& picture, const Image& without_subject);

struct PictureError {
  double psnr_db = 0.0;       // of red, green and blue; 99 where there is no difference
  double ssim = 1.0;          // mean over blocks of 8 x 8 of luma, K1 0.01, K2 0.03 (Wang et al. 2004)
  double delta_e = 0.0;       // mean distance in CIE L*a*b* after a mean over 3 x 3 pixels: 1 is just seen
  double masked_share = 0.0;  // of the picture
};

/// Compares two pictures. BadInput for different sizes of pictures or mask, and for an empty mask.
Result<PictureError> picture_error(const Image& seen, const Image& truth, const PictureMask& mask);

/// Shrinks a picture by averaging the linear light of factor x factor pixels; its sides must be multiples of
/// `factor`.
Image shrunk(const Image& image, uint32_t factor);

}  // namespace strandcast
