#include "common/render/passes/backdrop.h"

#include <epoxy/gl.h>

#include <utility>

#include "common/pictures/image_codec.h"
#include "shaders/shared/backdrop.h"

namespace strandcast {

Status Backdrop::prepare(const gl::ShaderLibrary& shaders, std::vector<std::string> files,
                         gl::Variant variant) {
  shaders_ = &shaders;
  files_ = std::move(files);
  variant_ = std::move(variant);
  ASSIGN_OR_RETURN(plain_, gl::Program::make(shaders, files_, variant_));
  return {};
}

Result<const gl::Program*> Backdrop::use(const Image* backdrop) {
  if (backdrop == nullptr) {
    plain_.use();
    return &plain_;
  }
  if (over_.name() == 0) {
    gl::Variant over = variant_;
    over["HAS_BACKDROP"] = 1;
    ASSIGN_OR_RETURN(over_, gl::Program::make(*shaders_, files_, over));
  }
  upload(*backdrop);
  texture_.bind(shader::kUnitBackdrop);
  over_.use();
  return &over_;
}

void Backdrop::upload(const Image& image) {
  if (texture_.width() != image.width || texture_.height() != image.height)
    texture_ = gl::Texture("backdrop", GL_RGBA8, image.width, image.height, 1);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage2D(texture_.name(), 0, 0, 0, static_cast<GLsizei>(image.width),
                      static_cast<GLsizei>(image.height), GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
}

}  // namespace strandcast
