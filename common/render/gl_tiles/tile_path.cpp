// The main methods on a GPU: strands are expanded, lit and shaded once per point by compute kernels, sorted
// into tiles and blended there front to back, as common/render/tiles does on processors, by the same laws.

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/gl/device_limits.h"
#include "common/render/gl_tiles/gpu_bins.h"
#include "common/render/gl_tiles/gpu_lattice.h"
#include "common/render/gl_tiles/tile_block.h"
#include "common/render/passes/backdrop.h"
#include "common/render/passes/head_mesh.h"
#include "common/render/render_path.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/tiles.h"

namespace strandcast {

std::unique_ptr<RenderPass> make_upload_pass(RenderScene& scene);

namespace {

constexpr uint64_t kPointBytes = 32;
constexpr uint64_t kStrandBytes = 16;
// Points of all drawn strands at most: 128 MiB. More, and fewer strands are drawn.
constexpr uint64_t kMaxGpuPoints = uint64_t{4} << 20;
// Samples of the head per pixel side.
constexpr uint32_t kHeadSide = 2;

/// Drawn strands: shaders/render/tile_points.glsl.
class GpuPoints final : public gl::Resource {
 public:
  GpuPoints() : Resource("points") {}
  void bind() const {
    points.bind_texels(shader::kUnitTilePoints);
    strands.bind_texels(shader::kUnitTileStrands);
  }
  void bind_storage() const {
    points.buffer().bind_storage(shader::kBindingTilePoints);
    strands.buffer().bind_storage(shader::kBindingTileStrands);
  }
  uint64_t size_bytes() const override { return points.size_bytes() + strands.size_bytes(); }

  GrownBuffer points{"points", GL_RGBA32UI};
  GrownBuffer strands{"strands", GL_RGBA32UI};
};

/// What all passes of one picture know of it.
class TileFrame final : public gl::Resource {
 public:
  explicit TileFrame(const RenderScene& scene)
      : Resource("tile frame", sizeof(TileBlock)), facts(detail_facts(scene)) {}

  DetailFacts facts;
  LightLatticeDesc lattice_desc;  // once expansion is prepared
  gl::Buffer uniforms;
  TileBlock block;
  LightDirections lights;
  LatticeFrame lattice;
  StrandDetail detail;

  void send() {
    uniforms.write(0, std::as_bytes(std::span(&block, 1)));
    uniforms.bind_uniform(shader::kBindingTileFrame);
  }
};

uint32_t groups_of(uint32_t count, uint32_t size) {
  return (count + size - 1) / size;
}

class TileExpandPass final : public RenderPass {
 public:
  TileExpandPass(RenderScene& scene, TileFrame& frame, GpuPoints& points)
      : Pass({"render/expand",
              {scene.features.has_strands.value ? static_cast<const gl::Resource*>(&scene.key_strands)
                                                : &scene.strands},
              {&points},
              true,
              {}}),
        scene_(scene),
        frame_(frame),
        points_(points) {}

  uint64_t size_bytes() const override { return triangle_.size_bytes() + sizeof(TileBlock); }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/tile_expand.comp"}, {}));
    const std::vector<uint8_t> parted = parted_triangles(setup.asset);
    std::vector<glm::uvec4> triangles;
    triangles.reserve(setup.asset.triangle.size());
    for (size_t i = 0; i < parted.size(); ++i) triangles.emplace_back(setup.asset.triangle[i], parted[i]);
    if (triangles.empty()) triangles.emplace_back(0u);
    triangle_ = gl::Buffer::of("root triangle", triangles);
    triangle_texels_ = gl::Texture::view_of("root triangle", GL_RGBA32UI, triangle_);
    if (scene_.features.has_strands.value)
      key_texels_ = gl::Texture::view_of("key position", GL_RGB32F, scene_.key_strands.position());
    frame_.uniforms = gl::Buffer("tile frame", sizeof(TileBlock));
    frame_.lattice_desc = describe_lattice(setup.asset, scene_, kLightCells);
    const gl::DeviceLimits limits = gl::read_device_limits();
    constexpr uint64_t kTexelsPerPoint = 2;
    frame_.facts.max_points =
        std::min({kMaxGpuPoints, limits.of(gl::DeviceLimit::StorageBlockBytes) / kPointBytes,
                  limits.of(gl::DeviceLimit::BufferTexels) / kTexelsPerPoint});
    return {};
  }

  Status run(RenderTurn& turn) override {
    frame_.detail = choose_detail(frame_.facts, scene_.look, turn.view, turn.terms);
    const StyleNumbers style = style_numbers(scene_.look, frame_.facts.mean_length_m);
    frame_.lights = light_directions(scene_.look, turn.strands.world_from_head.rotation, turn.view.up);
    frame_.lattice =
        fit_lattice(frame_.lattice_desc, frame_.lights, turn.strands.position_m, style_room_m(style));
    frame_.block = make_tile_block({scene_.look, turn.view, frame_.facts, frame_.detail, frame_.lights,
                                    frame_.lattice, kSkinLift * frame_.lattice.soft_m});
    frame_.send();
    const uint64_t strands = frame_.detail.strand_count;
    // Never without storage: views of it have to be there.
    points_.points.reserve(std::max<uint64_t>(strands, 1) * frame_.block.followers.z * kPointBytes);
    points_.strands.reserve(std::max<uint64_t>(strands, 1) * kStrandBytes);
    points_.bind_storage();
    key_texels_.bind(shader::kUnitTileKeys);
    triangle_texels_.bind(shader::kUnitTileTriangles);
    program_.use();
    glDispatchCompute(groups_of(frame_.detail.strand_count, shader::kStrandLocalSize), 1, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    turn.drawn_strands = strands;
    turn.left_out_strands =
        strands_without_room(frame_.facts, scene_.look, turn.view, turn.terms, frame_.detail);
    return {};
  }

 private:
  RenderScene& scene_;
  TileFrame& frame_;
  GpuPoints& points_;
  gl::Program program_;
  gl::Buffer triangle_;
  gl::Texture triangle_texels_;
  gl::Texture key_texels_;
};

class TileLightPass final : public RenderPass {
 public:
  TileLightPass(TileFrame& frame, GpuPoints& points, GpuLattice& lattice)
      : Pass({"render/light", {&points}, {&lattice}, true, {}}),
        frame_(frame),
        points_(points),
        lattice_(lattice) {}
  Status prepare(const RenderSetup& setup) override {
    return lattice_.prepare(setup.shaders, *frame_.lattice_desc.solid);
  }
  Status run(RenderTurn& turn) override {
    points_.bind();
    lattice_.set_bust(frame_.lattice_desc.bust, turn.strands.bust);
    lattice_.build(frame_.lattice, frame_.lights, frame_.detail.strand_count, frame_.block.strand.x);
    return {};
  }

 private:
  TileFrame& frame_;
  GpuPoints& points_;
  GpuLattice& lattice_;
};

class TileShadePass final : public RenderPass {
 public:
  TileShadePass(TileFrame& frame, GpuPoints& points, GpuLattice& lattice)
      : Pass({"render/shade", {&points, &lattice}, {&points}, true, {}}),
        frame_(frame),
        points_(points),
        lattice_(lattice) {}
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/tile_shade.comp"}, {}));
    return {};
  }
  Status run(RenderTurn&) override {
    points_.bind();
    points_.bind_storage();
    lattice_.bind();
    program_.use();
    glDispatchCompute(groups_of(frame_.detail.strand_count, shader::kStrandLocalSize), 1, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return {};
  }

 private:
  TileFrame& frame_;
  GpuPoints& points_;
  GpuLattice& lattice_;
  gl::Program program_;
};

class TileBinPass final : public RenderPass {
 public:
  TileBinPass(TileFrame& frame, GpuPoints& points, GpuBins& bins)
      : Pass({"render/bin", {&points}, {&bins}, true, {}}), frame_(frame), points_(points), bins_(bins) {}
  Status prepare(const RenderSetup& setup) override {
    max_pairs_ = std::min(kMaxGpuTilePairs, gl::read_device_limits().of(gl::DeviceLimit::BufferTexels));
    return bins_.prepare(setup.shaders);
  }
  Status run(RenderTurn& turn) override {
    points_.bind();
    const glm::uvec2 tiles(frame_.block.grid);
    const auto segments = [&] { return uint64_t{frame_.block.grid.z} * frame_.block.followers.z; };
    GpuBinCounts counts = bins_.count(tiles, segments());
    while (counts.pairs > max_pairs_ && frame_.block.grid.z > 0) {
      // Fewer strands, by a little more than is needed.
      constexpr double kRoom = 0.9;
      const double share = kRoom * static_cast<double>(max_pairs_) / static_cast<double>(counts.pairs);
      frame_.block.grid.z = static_cast<uint32_t>(frame_.block.grid.z * share);
      frame_.send();
      counts = bins_.count(tiles, segments());
    }
    bins_.fill(tiles, segments(), counts.pairs);
    turn.drawn_segments = counts.segments;
    turn.unusable_segments = counts.not_finite;
    const uint64_t no_room = frame_.detail.strand_count - frame_.block.grid.z;
    turn.drawn_strands -= no_room;
    turn.left_out_strands += no_room;
    return {};
  }

 private:
  TileFrame& frame_;
  GpuPoints& points_;
  GpuBins& bins_;
  uint64_t max_pairs_ = 0;
};

class TileHeadPass final : public RenderPass {
 public:
  explicit TileHeadPass(RenderScene& scene)
      : Pass({"render/head",
              {&scene.strands},
              {&scene.scene},
              scene.features.has_head_mesh.value,
              scene.features.has_head_mesh.reason}),
        scene_(scene) {}
  uint64_t size_bytes() const override { return HeadMesh::size_bytes(scene_); }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_,
                     gl::Program::make(setup.shaders, {"render/head.vert", "render/tile_head.frag"}, {}));
    mesh_ = HeadMesh(setup.asset, scene_);
    return {};
  }
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(scene_.scene.resize(turn.size_px));
    scene_.scene.clear();
    scene_.scene.begin();
    program_.use();
    program_.set("u_clip_from_head", turn.view.clip_from_head);
    mesh_.pose(turn.strands.bust);
    mesh_.draw();
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return {};
  }

 private:
  RenderScene& scene_;
  gl::Program program_;
  HeadMesh mesh_;
};

gl::Resources drawn_from(const RenderScene& scene, const GpuPoints& points, const GpuLattice& lattice,
                         const GpuBins& bins) {
  gl::Resources reads{&points, &lattice, &bins};
  if (scene.features.has_head_mesh.value) reads.push_back(&scene.scene);
  return reads;
}

class TileDrawPass final : public RenderPass {
 public:
  TileDrawPass(RenderScene& scene, TileFrame& frame, GpuPoints& points, GpuLattice& lattice, GpuBins& bins)
      : Pass({"render/draw", drawn_from(scene, points, lattice, bins), {&scene.picture}, true, {}}),
        scene_(scene),
        frame_(frame),
        points_(points),
        lattice_(lattice),
        bins_(bins) {}
  Status prepare(const RenderSetup& setup) override {
    return backdrop_.prepare(setup.shaders, {"render/tile_draw.comp"}, {});
  }
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(scene_.picture.resize(turn.size_px));
    if (turn.terms.is_unwanted && turn.terms.is_unwanted()) {
      turn.is_whole = false;
      return {};
    }
    points_.bind();
    lattice_.bind();
    bins_.bind();
    ASSIGN_OR_RETURN(const gl::Program* const program, backdrop_.use(turn.terms.backdrop));
    const bool has_head = scene_.features.has_head_mesh.value;
    program->set("u_head_share", has_head ? 1.0f / (kHeadSide * kHeadSide) : 0.0f);
    if (has_head) {
      scene_.scene.color().bind(shader::kUnitTileHeadSkin);
      scene_.scene.depth().bind(shader::kUnitTileHeadDepth);
    }
    glBindImageTexture(shader::kImageTilePicture, scene_.picture.color().name(), 0, GL_FALSE, 0,
                       GL_WRITE_ONLY, GL_RGBA8);
    const glm::uvec4& grid = frame_.block.grid;
    glDispatchCompute(groups_of(grid.x, shader::kTilesPerGroup), grid.y, 1);
    glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
    return {};
  }

 private:
  RenderScene& scene_;
  TileFrame& frame_;
  GpuPoints& points_;
  GpuLattice& lattice_;
  GpuBins& bins_;
  Backdrop backdrop_;
};

void add_tile_passes(RenderScene& scene, RenderPassList& passes) {
  scene.scene.set_layout({kHeadSide, 1, GL_RGBA8});
  auto& frame = passes.keep(std::make_unique<TileFrame>(scene));
  auto& points = passes.keep(std::make_unique<GpuPoints>());
  auto& lattice = passes.keep(std::make_unique<GpuLattice>());
  auto& bins = passes.keep(std::make_unique<GpuBins>());
  passes.add(make_upload_pass(scene));
  passes.add(std::make_unique<TileExpandPass>(scene, frame, points));
  passes.add(std::make_unique<TileLightPass>(frame, points, lattice));
  passes.add(std::make_unique<TileShadePass>(frame, points, lattice));
  passes.add(std::make_unique<TileBinPass>(frame, points, bins));
  passes.add(std::make_unique<TileHeadPass>(scene));
  passes.add(std::make_unique<TileDrawPass>(scene, frame, points, lattice, bins));
}

}  // namespace

const RenderPath& tile_path() {
  static const RenderPath path{"tiles", "compute kernels blend strands in tiles, front to back",
                               add_tile_passes, 1, std::nullopt};
  return path;
}

}  // namespace strandcast
