#include "server/app/groom_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <system_error>

#include "common/base/file.h"
#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/gl/egl_context.h"
#include "common/groom/groom_asset.h"
#include "common/groom/head_measure.h"
#include "common/pictures/image_codec.h"
#include "common/render/render_device.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

constexpr uint32_t kPictureSide = 480;
constexpr float kFieldOfViewRad = 0.3f;  // from afar: nearly without perspective
constexpr float kMargin = 1.1f;
// Strands are drawn alone and as wide as a pixel: the picture shows where they are, not how they look.
constexpr float kPixelsPerStrand = 0.6f;
constexpr uint32_t kSphereRings = 12;
constexpr float kBelowHairM = 0.06f;  // so much of the head is shown below the hair

/// From the front, from the left side of the head, from behind, from above.
constexpr std::array kDirections = {glm::vec3(0, 0, 1), glm::vec3(1, 0, 0), glm::vec3(0, 0, -1),
                                    glm::vec3(0, 1, 0)};

struct Box {
  glm::vec3 low{0.0f}, high{0.0f};
  void add(const glm::vec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
};

/// The hair and the head; of neck and shoulders only what is beside the hair.
Box box_of(const SceneContent& content, const Mesh& head) {
  Box box{content.groom.rest_position_m.front(), content.groom.rest_position_m.front()};
  for (const glm::vec3& point : content.groom.rest_position_m) box.add(point);
  const float lowest_m = box.low.y - kBelowHairM;
  for (const glm::vec3& point : head.position_m)
    if (point.y >= lowest_m) box.add(point);
  return box;
}

/// Appends a ball of triangles.
void add_ball(const SphereCollider& sphere, Mesh& mesh) {
  constexpr uint32_t kColumns = 2 * kSphereRings;
  const auto first = static_cast<uint32_t>(mesh.position_m.size());
  for (uint32_t ring = 0; ring <= kSphereRings; ++ring)
    for (uint32_t column = 0; column < kColumns; ++column) {
      const double down = 3.14159265358979 * ring / kSphereRings,
                   around = 6.28318530717959 * column / kColumns;
      const glm::vec3 normal(
          glm::dvec3(std::sin(down) * std::sin(around), std::cos(down), std::sin(down) * std::cos(around)));
      mesh.normal.push_back(normal);
      mesh.position_m.push_back(sphere.center_m + sphere.radius_m * normal);
    }
  for (uint32_t ring = 0; ring < kSphereRings; ++ring)
    for (uint32_t column = 0; column < kColumns; ++column) {
      const uint32_t here = first + ring * kColumns + column,
                     next = first + ring * kColumns + (column + 1) % kColumns;
      mesh.triangle.emplace_back(here, here + kColumns, next);
      mesh.triangle.emplace_back(next, here + kColumns, next + kColumns);
    }
}

/// Copies a picture into the sheet.
void paste(const Image& picture, uint32_t column, uint32_t row, Image& sheet) {
  for (uint32_t y = 0; y < picture.height; ++y)
    std::copy_n(picture.rgba.begin() + 4 * size_t{y} * picture.width, 4 * size_t{picture.width},
                sheet.rgba.begin() +
                    4 * ((size_t{row} * kPictureSide + y) * sheet.width + size_t{column} * kPictureSide));
}

/// One row of the sheet: a head (or none) under the hair (or none), from all sides.
Status draw_row(RenderDevice& device, const SceneAsset& asset, const SceneDesc& scene, const Box& box,
                uint32_t row, Image& sheet) {
  const glm::vec3 size_m = box.high - box.low;
  const float reach_m = std::max({size_m.x, size_m.y, size_m.z, 1e-3f});
  CameraDesc camera;
  camera.fov_y_rad = kFieldOfViewRad;
  camera.target_m = 0.5f * (box.low + box.high);
  const float away_m = 0.5f * kMargin * reach_m / std::tan(0.5f * kFieldOfViewRad) + 0.5f * reach_m;
  LookDesc look = scene.look;
  look.followers = 0;
  look.tip_scale = 1.0f;
  look.strand_radius_m = 0.5f * kPixelsPerStrand * kMargin * reach_m / kPictureSide;
  ASSIGN_OR_RETURN(auto renderer, device.make_renderer(asset, look));
  PosedStrands strands;
  strands.position_m = asset.rest_position_m;
  for (uint32_t view = 0; view < kDirections.size(); ++view) {
    camera.offset_m = away_m * kDirections[view];
    RETURN_IF_ERROR(renderer->draw(strands, camera, {kPictureSide, kPictureSide}));
    paste(renderer->read_image(), view, row, sheet);
  }
  return {};
}

}  // namespace

Mesh mesh_of_balls(const std::vector<SphereCollider>& balls) {
  Mesh mesh;
  for (const SphereCollider& ball : balls) add_ball(ball, mesh);
  return mesh;
}

std::vector<SphereCollider> balls_along(const std::vector<BodyCapsule>& capsules) {
  constexpr int kBalls = 8;
  std::vector<SphereCollider> balls;
  for (const BodyCapsule& capsule : capsules)
    for (int i = 0; i < kBalls; ++i) {
      const double share = static_cast<double>(i) / (kBalls - 1);
      balls.push_back({glm::vec3(glm::mix(capsule.from_m, capsule.to_m, share)),
                       static_cast<float>(glm::mix(capsule.from_radius_m, capsule.to_radius_m, share))});
    }
  return balls;
}

namespace {

/// Says what is done of a check, after how long, and how long the rest takes where that is known.
class CheckProgress {
 public:
  explicit CheckProgress(const std::function<void(const std::string&)>& tell) : tell_(tell) {}
  void say(const std::string& sentence) const {
    if (tell_) tell_(fmt::format("after {:.1f} s: {}", passed_s(begin_ns_), sentence));
  }
  /// `from_ns`: when the first of `count` parts began, which take equally long.
  void say_part(size_t done, size_t count, int64_t from_ns, const char* what) const {
    const double left_s = passed_s(from_ns) * static_cast<double>(count - done) / static_cast<double>(done);
    say(fmt::format("{} of {} {}{}", done, count, what,
                    done == count ? "" : fmt::format(", about {:.0f} s are left for the others", left_s)));
  }

 private:
  static double passed_s(int64_t from_ns) { return static_cast<double>(now_ns() - from_ns) / kNsPerS; }
  const std::function<void(const std::string&)>& tell_;
  int64_t begin_ns_ = now_ns();
};

/// Makes the solver and takes steps with it, as a server would. Returns a sentence, and what the solver says
/// of the hair.
Result<std::string> step_groom(SceneDesc scene, const SceneContent& content, const MeasureConfig& config) {
  RuntimeFacts facts;
  facts.strand_viewers = 1;
  scene = with_material(std::move(scene), content.material);
  scene.stream.codec = "raw";  // what is sent is no matter here
  ASSIGN_OR_RETURN(const Measured measured, measure_passes(scene, content, facts, config));
  ASSIGN_OR_RETURN(const std::vector<std::string> said, explain_groom(scene, content.groom));
  std::string text;
  for (const std::string& sentence : said) text += sentence + "\n";
  return text + fmt::format("{} steps are taken with {} on {}\n", kMeasuredSteps, scene.solver.name,
                            measured.sim_device);
}

/// Draws hair alone, hair on its head, hair on what collides, and saves the picture. Returns a sentence.
Result<std::string> draw_groom(const SceneDesc& scene, const SceneContent& content, const BodyShapes& body,
                               const std::filesystem::path& picture, const MeasureConfig& config,
                               const CheckProgress& progress) {
  ASSIGN_OR_RETURN(const auto device,
                   RenderDevice::open({config.renderer, config.gl_device, config.shader_folder}));
  const bool is_field = content.head_field != nullptr && content.colliders.empty();
  std::vector<SphereCollider> balls = content.colliders;
  for (const SphereCollider& ball : balls_along(body.capsules)) balls.push_back(ball);
  const std::array<Mesh, 3> heads = {Mesh{}, content.head, is_field ? content.head : mesh_of_balls(balls)};
  const Box box = box_of(content, content.head);
  Image sheet{kPictureSide * static_cast<uint32_t>(kDirections.size()),
              kPictureSide * static_cast<uint32_t>(heads.size()),
              {}};
  sheet.rgba.resize(4 * size_t{sheet.width} * sheet.height);
  const int64_t begin_ns = now_ns();
  for (uint32_t row = 0; row < heads.size(); ++row) {
    RETURN_IF_ERROR(draw_row(*device, make_scene_asset(content.groom, heads[row]), scene, box, row, sheet));
    progress.say_part(row + 1, heads.size(), begin_ns, "rows of pictures are drawn");
  }
  RETURN_IF_ERROR(save_png(picture, sheet));
  const std::string last = is_field ? "on the head once more, which collides itself"
                                    : fmt::format("on the {} spheres that collide", content.colliders.size());
  return fmt::format(
      "{}: from the front, from its left side, from behind and from above; hair alone, on the head, {}\n",
      picture.string(), last);
}

}  // namespace

Result<std::string> check_groom(const SceneDesc& scene, const std::filesystem::path& folder,
                                const MeasureConfig& config,
                                const std::function<void(const std::string&)>& on_progress) {
  const CheckProgress progress(on_progress);
  progress.say("the hair is read, and a head fitted");
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  progress.say(fmt::format("{} strands x {} vertices are read, and drawn now", content.groom.strand_count(),
                           content.groom.uniform_vertex_count()));
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure)
    return make_error(ErrorCode::Unavailable, "cannot make the folder {}: {}", folder.string(),
                      failure.message());
  const BodyShapes body = shapes_of(scene.body, {});  // as far as it needs no stream
  ASSIGN_OR_RETURN(const std::string drawn,
                   draw_groom(scene, content, body, folder / "groom.png", config, progress));
  std::string text;
  for (const std::string& note : content.notes) text += note + "\n";
  if (!content.unlikely.empty()) text += content.unlikely + "\n";
  if (!body.capsules.empty()) {
    BodyInput fixed;
    fixed.capsules = body.capsules;
    text += to_sentence(measure_inside(fixed, content.groom), body.capsules.size()) + "\n";
  }
  for (const std::string& sentence : body.missing) text += sentence + ": drawn without\n";
  text += drawn;
  progress.say(fmt::format("{} steps are taken with {}", kMeasuredSteps, scene.solver.name));
  const Result<std::string> stepped = step_groom(scene, content, config);
  if (stepped) text += *stepped;
  RETURN_IF_ERROR(save_file(folder / "groom.txt", std::as_bytes(std::span(text))));
  if (!content.unlikely.empty())
    return make_error(ErrorCode::BadInput, "{} (the picture is in {})", content.unlikely, folder.string());
  if (!stepped) return stepped.error();
  return text;
}

}  // namespace strandcast
