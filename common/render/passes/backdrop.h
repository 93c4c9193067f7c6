// Backdrop: a picture on the device that is seen behind what is drawn, instead of the look's background, and
// the programs that draw over either. Allocated at the first draw that has one. GL thread.
#pragma once

#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/render_turn.h"

namespace strandcast {

class Backdrop {
 public:
  /// Makes the program that draws over the background from these shaders; `variant` must not set
  /// HAS_BACKDROP. `shaders` must outlive this object.
  Status prepare(const gl::ShaderLibrary& shaders, std::vector<std::string> files, gl::Variant variant);
  /// Activates the program for a draw with this backdrop, or with none if null, sets its inputs and returns
  /// it.
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
