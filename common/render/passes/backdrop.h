// Backdrop: the picture that lies behind what is drawn instead of the look's background, on the device, and
// the programs that draw over either. Nothing of it exists before the first draw with one. GL thread.
#pragma once

#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/render_turn.h"

namespace strandcast {

class Backdrop {
 public:
  /// Makes the program of these shaders that draws over the background; `variant` without HAS_BACKDROP.
  /// `shaders` outlives this.
  Status prepare(const gl::ShaderLibrary& shaders, std::vector<std::string> files, gl::Variant variant);
  /// The program for a draw with this backdrop, or with none, in use and with what it reads of it.
  Result<const gl::Program*> use(const Image* backdrop);
  uint64_t size_bytes() const { return texture_.size_bytes(); }

 private:
  void upload(const Image& image);

  const gl::ShaderLibrary* shaders_ = nullptr;
  std::vector<std::string> files_;
  gl::Variant variant_;
  gl::Program plain_;
  gl::Program over_;
  gl::Texture texture_;
};

}  // namespace strandcast
