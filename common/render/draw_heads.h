// draw_heads: draws one picture of one or several heads. Each head has its own renderer, look, light and
// shadows. The farthest is drawn first, each over the picture of those before it. Where the hair of two heads
// overlaps, the nearer head's is in front. Heads do not shadow each other. Runs on the renderers' thread.
#pragma once

#include <span>

#include "common/render/renderer.h"

namespace strandcast {

struct PlacedHead {
  Renderer* renderer = nullptr;
  const PosedStrands* strands = nullptr;
};

/// Returns the point that a picture's camera follows: the middle of the heads (at least one), world, m.
glm::dvec3 middle_of(std::span<const PlacedHead> heads);

/// Converts a camera that follows `middle_m` into one that follows `head_m` and shows the same view.
CameraDesc camera_from_head(const CameraDesc& camera, const glm::dvec3& middle_m, const glm::dvec3& head_m);

/// Camera of a picture of heads; it follows their middle.
struct HeadsCamera {
  CameraDesc own;
  CameraDesc of_scene;  // from which all heads are to be seen
};
/// Returns the factor on the scene camera's distance at which all heads are in the picture; 1 if they already
/// are. The viewer's own camera is moved by it too, so that no head is out of view.
double room_factor(std::span<const PlacedHead> heads, const CameraDesc& of_scene, RenderSize size);

struct HeadsPicture {
  Image image;
  RenderProfile profile;  // of all
};

/// Draws the heads. With one head the result equals that renderer's draw() and read_image(). A picture that
/// was abandoned has no pixels. Errors as Renderer::draw().
Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const HeadsCamera& camera, RenderSize size,
                                const DrawTerms& terms = {});

}  // namespace strandcast
