// draw_heads: one picture of one or several heads. Each is drawn by a renderer of its own, with its own look,
// light and shadows; the farthest first, and each over the picture of those before it. Where hair of two
// heads lies within each other the nearer head's is in front, and no head shadows another. Runs where the
// renderers do.
#pragma once

#include <span>

#include "common/render/renderer.h"

namespace strandcast {

struct PlacedHead {
  Renderer* renderer = nullptr;
  const PosedStrands* strands = nullptr;
};

/// The point that a picture's camera follows: the middle of the heads, world, m. There is at least one.
glm::dvec3 middle_of(std::span<const PlacedHead> heads);

/// A camera that follows `middle_m`, as one that follows `head_m`: what either sees is the same.
CameraDesc camera_from_head(const CameraDesc& camera, const glm::dvec3& middle_m, const glm::dvec3& head_m);

struct HeadsPicture {
  Image image;
  RenderProfile profile;  // of all
};

/// `camera` follows the middle of the heads. With one head the same as that renderer's own draw() and
/// read_image(). A picture that was given up half-way has no pixels. Errors as Renderer::draw().
Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const CameraDesc& camera, RenderSize size,
                                const DrawTerms& terms = {});

}  // namespace strandcast
