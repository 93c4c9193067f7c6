// Exports of strands as they are drawn, and of the head under them: files come back with the strands, the
// taper and the mesh of a picture.
#include <algorithm>
#include <cmath>

#include "client/app/drawn_states.h"
#include "client/export/export_strands.h"
#include "common/base/file.h"
#include "common/groom/abc_curves.h"
#include "common/groom/abc_loader.h"
#include "common/groom/abc_tree.h"
#include "common/groom/groom_asset.h"
#include "common/groom/ply_loader.h"
#include "common/groom/procedural.h"
#include "common/groom/usd_loader.h"
#include "common/render/drawn_strands.h"
#include "common/render/tiles/tile_renderer.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/usdc_found.h"

namespace strandcast::drawn_export_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

const std::atomic<bool> kGoesOn{false};
constexpr float kLatticeM = 1e-6f;

/// Two states of hair at rest, on a head that stands elsewhere and is turned.
class StillStates : public ExportSource {
 public:
  StillStates() {
    ProceduralGroomOptions grown;
    grown.strand_count = 60;
    const Groom groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), 0.095f, 200), grown).value();
    scene_.asset = std::make_shared<const SceneAsset>(make_scene_asset(groom, make_head(0.095f)));
    scene_.strand_radius_m = 0.0001f;
    QuantiseInput input;
    input.world_from_head = pose();
    input.strand_count = scene_.asset->strand_count;
    input.vertex_count = scene_.asset->vertex_count;
    input.quantum_m = kLatticeM;
    input.position_in_head_m = scene_.asset->rest_position_m;
    for (const int64_t time_ns : {0, 50'000'000}) {
      input.sim_time_ns = time_ns;
      states_.push_back(std::make_shared<const Snapshot>(quantise(input).snapshot));
    }
  }
  static Pose pose() { return {{0.3, 1.6, -0.2}, glm::angleAxis(0.7, glm::dvec3(0, 1, 0))}; }

  const ExportScene& scene() const override { return scene_; }
  Result<std::shared_ptr<const Snapshot>> next() override {
    if (next_ < states_.size()) return states_[next_++];
    return std::shared_ptr<const Snapshot>();
  }
  std::vector<std::string> remarks() const override { return {}; }

  ExportScene scene_;
  std::vector<std::shared_ptr<const Snapshot>> states_;
  size_t next_ = 0;
};

class DrawnExport : public testing::Test {
 protected:
  DrawnExport() {
    look_.followers = 2;
    look_.style.length_spread = 0.3f;  // strands of different lengths
    options_.unit_m = 1.0;
    options_.is_quiet = true;
    expected_ = DrawnHair::make(*asset_, look_)->strands(asset_->rest_position_m);
  }
  std::filesystem::path written(const char* name) {
    options_.path = folder_.path() / name;
    const auto source = as_drawn(std::make_unique<StillStates>(), look_).value();
    const auto report = export_strands(*source, options_, kGoesOn);
    EXPECT_TRUE(report) << report.error().to_string();
    if (report) report_ = *report;
    return options_.path;
  }
  void expect_strands(const Groom& groom, double bound_m) const {
    EXPECT_EQ(std::vector<uint32_t>(groom.offset.begin(), groom.offset.end()), expected_.first_point);
    ASSERT_EQ(groom.rest_position_m.size(), expected_.position_m.size());
    for (size_t i = 0; i < expected_.position_m.size(); ++i)
      EXPECT_LT(glm::distance(glm::dvec3(groom.rest_position_m[i]), glm::dvec3(expected_.position_m[i])),
                bound_m)
          << i;
  }

  const TemporaryFolder folder_;
  const std::shared_ptr<const SceneAsset> asset_ = StillStates().scene_.asset;
  LookDesc look_;
  ExportOptions options_;
  ExportReport report_;
  DrawnStrands expected_;
};

TEST_F(DrawnExport, HasTheStrandsOfAPictureInEveryFormat) {
  TileOptions finest;
  finest.is_finest = true;
  const auto renderer = make_tile_renderer(*asset_, look_, finest).value();
  ASSERT_TRUE(renderer->draw({{}, asset_->rest_position_m}, {}, {64, 64}));
  ASSERT_EQ(expected_.strand_count(), renderer->profile().drawn_strands);
  ASSERT_GT(expected_.strand_count(), asset_->strand_count);
  for (const bool has_head : {false, true}) {
    options_.has_head = has_head;
    expect_strands(load_usd(written("hair.usda"))->groom, 2e-6);
    EXPECT_EQ(report_.strand_count, expected_.strand_count());
    expect_strands(load_usd(written("hair.usdz"))->groom, 1e-6);
    expect_strands(load_abc(written("hair.abc"))->groom, 1e-6);
    options_.is_one_frame = true;
    expect_strands(load_ply(written("hair.ply"), 0)->groom, 2e-6);
    options_.is_one_frame = false;
  }
  const std::string rows = *load_text((options_.has_head = false, written("hair.csv")), 1 << 26);
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'),
            static_cast<ptrdiff_t>(1 + (report_.frame_count + 1) * expected_.position_m.size()));
}

TEST_F(DrawnExport, KeepsTheTaper) {
  const AbcArchive archive = AbcArchive::read(AbcContainer::open(written("hair.abc")).value()).value();
  const AbcTree tree = AbcTree::read(archive).value();
  for (const AbcNode& node : tree.nodes()) {
    if (node.kind != AbcKind::Curves) continue;
    const auto width = AbcCurvesReader::open(archive, node.object)->param("width", 0).value();
    ASSERT_TRUE(width);
    ASSERT_EQ(width->count(), expected_.width_m.size());
    for (size_t i = 0; i < width->count(); ++i)
      EXPECT_FLOAT_EQ(static_cast<float>(width->number(i)), expected_.width_m[i]);
  }
}

/// Vertices and corners of the mesh in an Alembic file.
std::pair<std::vector<glm::dvec3>, std::vector<uint32_t>> abc_mesh(const std::filesystem::path& path,
                                                                   uint64_t frame) {
  const AbcArchive archive = AbcArchive::read(AbcContainer::open(path).value()).value();
  const AbcTree tree = AbcTree::read(archive).value();
  std::pair<std::vector<glm::dvec3>, std::vector<uint32_t>> mesh;
  for (const AbcNode& node : tree.nodes()) {
    if (node.object.name != "Head") continue;
    const auto own = archive.properties(node.object).value();
    const auto geom = archive.properties(*find_abc_property(own, ".geom")).value();
    const auto numbers = [&](const char* name, uint64_t sample) {
      return archive.sample(*find_abc_property(geom, name), sample, 1 << 20).value();
    };
    const AbcSample points = numbers("P", frame);
    for (size_t i = 0; i < points.count(); ++i)
      mesh.first.emplace_back(points.number(i, 0), points.number(i, 1), points.number(i, 2));
    const AbcSample corners = numbers(".faceIndices", 0);
    for (size_t i = 0; i < corners.count(); ++i)
      mesh.second.push_back(static_cast<uint32_t>(corners.number(i)));
    EXPECT_EQ(numbers(".faceCounts", 0).count() * 3, corners.count());
  }
  return mesh;
}

TEST_F(DrawnExport, TheHeadIsThatOfTheSceneOnItsPose) {
  options_.has_head = true;
  const Mesh& head = asset_->head;
  for (const ExportSpace space : {ExportSpace::Head, ExportSpace::World}) {
    options_.space = space;
    const Pose pose = space == ExportSpace::World ? StillStates::pose() : Pose{};
    const auto [points, corners] = abc_mesh(written("hair.abc"), 1);
    ASSERT_EQ(points.size(), head.position_m.size());
    for (size_t i = 0; i < points.size(); ++i)
      EXPECT_LT(glm::distance(points[i], pose * glm::dvec3(head.position_m[i])), 1e-6) << i;
    // The other way round than ours.
    ASSERT_EQ(corners.size(), head.triangle.size() * 3);
    for (size_t i = 0; i < head.triangle.size(); ++i)
      EXPECT_EQ(glm::uvec3(corners[3 * i + 2], corners[3 * i + 1], corners[3 * i]), head.triangle[i]);
    const std::string usda = *load_text(written("hair.usda"), 1 << 26);
    EXPECT_THAT(usda, HasSubstr("def Mesh \"Head\""));
    const glm::uvec3 first = head.triangle.front();
    EXPECT_THAT(usda, HasSubstr(fmt::format("faceVertexIndices = [{}, {}, {}, ", first.x, first.y, first.z)));
    const test::UsdcFound usdc(written("hair.usdc"));
    const auto usdc_corners = *usdc.archive.ints(usdc.get("Head", "faceVertexIndices"), 1 << 20);
    ASSERT_EQ(usdc_corners.size(), corners.size());
    for (size_t i = 0; i < corners.size(); ++i)  // from the other end: the faces' order does not change
      EXPECT_EQ(static_cast<uint32_t>(usdc_corners[3 * (i / 3) + 2 - i % 3]), corners[i]);
    const auto moving = usdc.find("Head", "points", "timeSamples");
    EXPECT_EQ(moving.has_value(), space == ExportSpace::World);
    const UsdcValue usdc_points =
        moving ? (*usdc.archive.sample(*moving, 1))->value : usdc.get("Head", "points");
    const auto placed = *usdc.archive.points(usdc_points, 1 << 20);
    ASSERT_EQ(placed.size(), points.size());
    for (size_t i = 0; i < points.size(); ++i)
      EXPECT_LT(glm::distance(glm::dvec3(placed[i]), pose * glm::dvec3(head.position_m[i])), 1e-6) << i;
  }
  options_.is_one_frame = true;
  EXPECT_THAT(*load_text(written("hair.ply"), 1 << 26),
              HasSubstr(fmt::format("element face {}\n", head.triangle.size())));
}

// The counter-examples: without --head there is no mesh, and a table cannot have one.
TEST_F(DrawnExport, WithoutTheOptionThereIsNoHead) {
  EXPECT_TRUE(abc_mesh(written("hair.abc"), 0).first.empty());
  EXPECT_EQ(load_text(written("hair.usda"), 1 << 26)->find("Mesh"), std::string::npos);
  EXPECT_FALSE(test::UsdcFound(written("hair.usdc")).find("Head", "", "specifier"));
  options_.has_head = true;
  options_.path = "a.csv";
  EXPECT_THAT(check_export(options_).error().to_string(), HasSubstr("leave --head out"));
}

}  // namespace
}  // namespace strandcast::drawn_export_test
