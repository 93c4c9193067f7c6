#include "client/app/drawn_states.h"

#include <algorithm>
#include <utility>

#include "common/render/drawn_strands.h"
#include "common/render/strand_style.h"

namespace strandcast {
namespace {

/// How much a root is of three corners, in whose plane it lies.
glm::vec3 shares_of(const glm::dvec3& root, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, out = glm::cross(ab, ac);
  const double area = glm::dot(out, out);
  if (!(area > 0.0)) return {1.0f, 0.0f, 0.0f};
  const double of_b = std::clamp(glm::dot(glm::cross(root - a, ac), out) / area, 0.0, 1.0);
  const double of_c = std::clamp(glm::dot(glm::cross(ab, root - a), out) / area, 0.0, 1.0 - of_b);
  return glm::vec3(glm::dvec3(1.0 - of_b - of_c, of_b, of_c));
}

/// Keys come first, and followers triangle by triangle; those at a parting follow the nearest key alone.
std::vector<ExportGuides> guides_of(const SceneAsset& asset, const DrawnStrands& rest) {
  const uint32_t keys = asset.strand_count, strands = rest.strand_count();
  const std::vector<uint8_t> is_parted = parted_triangles(asset);
  const uint32_t followers =
      asset.triangle.empty()
          ? 1
          : std::max<uint32_t>(1, (strands - keys) / static_cast<uint32_t>(asset.triangle.size()));
  std::vector<ExportGuides> guides(strands);
  for (uint32_t strand = 0; strand < strands; ++strand) {
    ExportGuides& mine = guides[strand];
    mine.strand = glm::uvec3(strand);
    if (strand < keys) continue;
    const uint32_t triangle = (strand - keys) / followers;
    const RootTriangle& corner = asset.triangle[triangle];
    mine.strand = {corner[0], corner[1], corner[2]};
    mine.share = shares_of(rest.position_m[rest.first_point[strand]], asset.rest_position_m[corner[0]],
                           asset.rest_position_m[corner[1]], asset.rest_position_m[corner[2]]);
    if (is_parted[triangle] == 0) continue;
    const glm::vec3& share = mine.share;
    const int nearest = share.x >= share.y && share.x >= share.z ? 0 : share.y >= share.z ? 1 : 2;
    mine = {glm::uvec3(mine.strand[nearest]), {1.0f, 0.0f, 0.0f}};
  }
  return guides;
}

class DrawnShapes : public ExportDrawing {
 public:
  DrawnShapes(DrawnHair hair, const SceneAsset& asset) : hair_(std::move(hair)) {
    DrawnStrands rest = hair_.strands(asset.rest_position_m);
    std::vector<ExportGuides> guides = guides_of(asset, rest);
    shape_ = {std::move(rest.first_point), std::move(rest.width_m), std::move(guides)};
  }
  const ExportShape& shape() const override { return shape_; }
  std::vector<glm::vec3> points(const std::vector<glm::vec3>& position_m) override {
    return hair_.strands(position_m).position_m;
  }

 private:
  DrawnHair hair_;
  ExportShape shape_;
};

class StatesOfScene : public ExportSource {
 public:
  StatesOfScene(std::unique_ptr<ExportSource> source, ExportScene scene)
      : source_(std::move(source)), scene_(std::move(scene)) {}
  const ExportScene& scene() const override { return scene_; }
  std::optional<CountedState> counted() const override { return source_->counted(); }
  const TimecodeTrack& timecodes() const override { return source_->timecodes(); }
  Result<std::optional<int64_t>> skip_to(double from_s) override { return source_->skip_to(from_s); }
  Result<std::shared_ptr<const Snapshot>> next() override { return source_->next(); }
  std::vector<std::string> remarks() const override { return source_->remarks(); }

 private:
  std::unique_ptr<ExportSource> source_;
  ExportScene scene_;
};

}  // namespace

Result<std::unique_ptr<ExportSource>> as_drawn(std::unique_ptr<ExportSource> source, const LookDesc& look) {
  ExportScene scene = source->scene();
  ASSIGN_OR_RETURN(DrawnHair hair, DrawnHair::make(*scene.asset, look));
  scene.drawing = std::make_shared<DrawnShapes>(std::move(hair), *scene.asset);
  return std::unique_ptr<ExportSource>(std::make_unique<StatesOfScene>(std::move(source), std::move(scene)));
}

std::unique_ptr<ExportSource> with_origin(std::unique_ptr<ExportSource> source,
                                          std::shared_ptr<const ExportOrigin> origin) {
  ExportScene scene = source->scene();
  scene.origin = std::move(origin);
  return std::make_unique<StatesOfScene>(std::move(source), std::move(scene));
}

}  // namespace strandcast
