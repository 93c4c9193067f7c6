// GrownBuffer: a GPU buffer that grows on demand, with a texel view for kernels, since a texel load costs
// half of a storage block's on llvmpipe. All calls from the context's thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "common/gl/objects.h"

namespace strandcast {

class GrownBuffer {
 public:
  /// Makes an empty buffer; a `texel_format` of 0 makes no view.
  GrownBuffer(std::string label, uint32_t texel_format = 0)
      : label_(std::move(label)), texel_format_(texel_format) {}

  /// Makes room for `size_bytes`; the contents are lost if the buffer grows.
  void reserve(uint64_t size_bytes) {
    if (size_bytes <= buffer_.size_bytes()) return;
    // The old one first: two sizes side by side may not fit.
    view_ = {};
    buffer_ = {};
    // A little more, so that a picture that is a little fuller needs no new one; whole texels.
    constexpr uint64_t kRoomDivisor = 8;
    constexpr uint64_t kTexelBytes = 16;
    buffer_ = gl::Buffer(label_,
                         (size_bytes + size_bytes / kRoomDivisor) / kTexelBytes * kTexelBytes + kTexelBytes);
    if (texel_format_ != 0) view_ = gl::Texture::view_of(label_, texel_format_, buffer_);
  }
  gl::Buffer& buffer() { return buffer_; }
  const gl::Buffer& buffer() const { return buffer_; }
  void bind_texels(uint32_t unit) const { view_.bind(unit); }
  uint64_t size_bytes() const { return buffer_.size_bytes(); }

 private:
  std::string label_;
  uint32_t texel_format_;
  gl::Buffer buffer_;
  gl::Texture view_;
};

}  // namespace strandcast
