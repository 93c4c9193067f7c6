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

/// Where a picture of heads is seen from: follows their middle.
struct HeadsCamera {
  CameraDesc own;
  CameraDesc of_scene;  // from which all heads are to be seen
};
/// How many times its distance the scene's camera must be away for all heads to be in its picture; 1 where
/// they are. One's own camera goes along, so that whoever stands elsewhere than the others is not lost.
double room_factor(std::span<const PlacedHead> heads, const CameraDesc& of_scene, RenderSize size);

struct HeadsPicture {
  Image image;
  RenderProfile profile;  // of all
};

/// With one head the same as that renderer's own draw() and read_image() from one's own camera. A picture
/// that was given up half-way has no pixels. Errors as Renderer::draw().
Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const HeadsCamera& camera, RenderSize size,
                                const DrawTerms& terms = {});

}  // namespace strandcast
