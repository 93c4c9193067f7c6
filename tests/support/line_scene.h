// Lines in place of expanded strands, so that a test knows every segment that a method draws: where it lies,
// how wide it is and what colour it has. All calls from the context's thread.
#pragma once

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "common/gl/egl_context.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"
#include "common/render/shadow/shadow_method.h"
#include "common/render/transparency/transparency.h"

namespace strandcast {

std::unique_ptr<RenderPass> make_clear_pass(RenderScene& scene);

namespace test {

/// A segment of a strand that has no other; all lines of a colour are shaded alike.
struct Line {
  glm::vec3 from_m{0.0f};
  glm::vec3 to_m{0.0f};
  float along = 0.0f;  // 0: the root's colour, 1: the tip's
};

/// Writes lines where the expand pass writes strands.
class LinesPass final : public RenderPass {
 public:
  LinesPass(RenderScene& scene, ExpandedStrands& expanded, std::vector<Line> lines, uint32_t batch_count,
            float width_m)
      : Pass({"render/expand", {&scene.strands}, {&expanded}, true, {}}),
        expanded_(expanded),
        lines_(std::move(lines)),
        batch_count_(batch_count),
        width_m_(width_m) {}

  bool is_batched() const override { return true; }
  Status prepare(const RenderSetup&) override {
    expanded_.allocate();
    return {};
  }
  Status run(RenderTurn& turn) override {
    const size_t per_batch = (lines_.size() + batch_count_ - 1) / batch_count_;
    const size_t first = std::min(lines_.size(), turn.batch_index * per_batch);
    const size_t end = std::min(lines_.size(), first + per_batch);
    std::vector<ExpandedVertex> vertices;
    for (size_t i = first; i < end; ++i) {
      const Line& line = lines_[i];
      const glm::vec3 way = line.to_m - line.from_m;
      const float length = glm::length(way);
      const glm::vec3 tangent = length > 0.0f ? way / length : glm::vec3(0.0f, -1.0f, 0.0f);
      vertices.push_back({line.from_m, line.along, tangent, 0});
      vertices.push_back({line.to_m, line.along, tangent, 0});
    }
    glNamedBufferSubData(expanded_.vertex().name(), 0,
                         static_cast<GLsizeiptr>(vertices.size() * sizeof(ExpandedVertex)), vertices.data());
    expanded_.segment_count = static_cast<uint32_t>(end - first);
    expanded_.width_m = width_m_;
    turn.has_more_batches = end < lines_.size();
    return {};
  }

 private:
  ExpandedStrands& expanded_;
  std::vector<Line> lines_;
  uint32_t batch_count_;
  float width_m_;
};

/// Key strands that reach as far as the lines.
inline SceneAsset asset_around(const std::vector<Line>& lines) {
  SceneAsset asset;
  asset.strand_count = 1;
  asset.vertex_count = 2;
  glm::vec3 low(0.0f), high(0.0f);
  bool has_point = false;
  for (const Line& line : lines)
    for (const glm::vec3& point : {line.from_m, line.to_m}) {
      if (!std::isfinite(glm::dot(point, point))) continue;
      low = has_point ? glm::min(low, point) : point;
      high = has_point ? glm::max(high, point) : point;
      has_point = true;
    }
  asset.rest_position_m = {low, high};
  return asset;
}

}  // namespace test
}  // namespace strandcast
