#include "common/render/tiles/tile_renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "common/groom/bust_skin.h"
#include "common/render/light_lattice.h"
#include "common/render/render_scene.h"
#include "common/render/scalp_cover.h"
#include "common/render/tiles/debug_picture.h"
#include "common/render/tiles/strand_expansion.h"
#include "common/render/tiles/strand_shading.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/tiles/tile_raster.h"
#include "common/render/view.h"

namespace strandcast {
namespace {

// Points of all drawn strands at most: 256 MiB. More, and fewer strands are drawn.
constexpr uint64_t kMaxPoints = uint64_t{8} << 20;

/// Memory of an object that a pass writes, as it is now.
template <class Object>
class Held final : public gl::Resource {
 public:
  Held(std::string name, const Object& object) : Resource(std::move(name)), object_(object) {}
  uint64_t size_bytes() const override { return object_.size_bytes(); }

 private:
  const Object& object_;
};

struct HeldImage {
  Image image;
  uint64_t size_bytes() const { return image.rgba.capacity(); }
};

LightLatticeDesc lattice_desc(const SceneAsset& asset, const RenderScene& scene, const TileOptions& options) {
  LightLatticeDesc desc = describe_lattice(asset, scene, options.light_cells);
  desc.set = options.set;
  return desc;
}

/// All that the passes of a picture share.
struct TileState {
  TileState(const SceneAsset& asset, const LookDesc& wanted, const RenderScene& facts,
            const TileOptions& options)
      : look(wanted),
        detail_facts(strandcast::detail_facts(facts)),
        workers(*options.workers),
        set(options.set),
        draws_hidden(options.draws_hidden),
        expansion(asset, facts.rest.mean_length_m),
        lattice(lattice_desc(asset, facts, options)),
        mesh(asset.head),
        skin(asset.head),
        cover(scalp_cover(asset, facts.rest.extent_m * kCoverReach)),
        scratch(workers.size()),
        srgb(make_srgb_table()) {
    detail_facts.max_points = kMaxPoints;
    detail_facts.is_finest = options.is_finest;
    expansion.set_look(look);
    if (!mesh.triangle.empty()) {
      head.mesh = &mesh;
      head.cover = &cover;
    }
  }

  LookDesc look;
  DetailFacts detail_facts;
  WorkerPool& workers;
  simd::InstructionSet set;
  bool draws_hidden;
  StrandExpansion expansion;
  StrandPoints points;
  LightLattice lattice;
  Mesh mesh;
  BustSkin skin;
  std::vector<float> cover;
  HeadPicture head;
  TileBins bins;
  std::vector<TileScratch> scratch;
  std::vector<uint8_t> srgb;
  std::vector<float> linear;  // once there was a backdrop
  HeldImage picture;

  // Of the draw that is under way.
  StrandDetail detail;
  ShadeInput shade;
  BinCounts counts;
};

/// A pass that is one function.
class TilePass final : public RenderPass {
 public:
  using Work = Status (*)(TileState&, RenderTurn&);
  TilePass(gl::PassDeclaration declaration, TileState& state, Work work)
      : Pass(std::move(declaration), gl::PassClock::Host), state_(state), work_(work) {}
  Status run(RenderTurn& turn) override { return work_(state_, turn); }

 private:
  TileState& state_;
  Work work_;
};

Status expand(TileState& state, RenderTurn& turn) {
  if (state.expansion.key_count() == 0) return {};
  state.detail = choose_detail(state.detail_facts, state.look, turn.view, turn.terms);
  turn.left_out_strands =
      strands_without_room(state.detail_facts, state.look, turn.view, turn.terms, state.detail);
  state.expansion.expand(turn.strands.position_m, state.detail, state.workers, state.set, state.points);
  turn.drawn_strands = state.detail.strand_count;
  return {};
}

Status light(TileState& state, RenderTurn& turn) {
  const uint32_t drawn = std::max(state.points.strand_count(), 1u);
  state.shade.width_m = drawn_width_m(state.detail_facts, state.look, drawn);
  state.shade.tip_scale = state.look.tip_scale;
  state.shade.tip_fade = state.look.style.tip_fade;
  state.shade.lights = light_directions(state.look, turn.strands.world_from_head.rotation, turn.view.up);
  const StyleNumbers style = style_numbers(state.look, state.detail_facts.mean_length_m);
  const LatticeFrame frame =
      fit_lattice(state.lattice.desc(), state.shade.lights, turn.strands.position_m, style_room_m(style));
  state.lattice.set_bust(turn.strands.bust);
  state.lattice.build(frame, state.points, {state.shade.width_m, state.shade.tip_scale, state.shade.tip_fade},
                      state.shade.lights, state.workers);
  return {};
}

Status shade(TileState& state, RenderTurn& turn) {
  state.shade.look = shading_numbers(state.look);
  if (!state.draws_hidden && turn.terms.debug_view != DebugView::Overdraw)
    state.lattice.hide_from(turn.view.eye_m);
  state.shade.lattice = state.lattice.view();
  state.shade.view = turn.view;
  state.shade.debug_view = turn.terms.debug_view;
  shade_points(state.shade, state.workers, state.set, state.points);
  return {};
}

Status bin(TileState& state, RenderTurn& turn) {
  const TileGrid grid{turn.size_px};
  state.counts = state.bins.bin_segments(state.points, grid, turn.view.near_m, state.workers);
  turn.drawn_segments = state.counts.segments;
  turn.left_out_strands += state.counts.left_out;
  turn.unusable_segments = state.counts.not_finite;
  if (state.head.mesh != nullptr) {
    state.skin.pose(turn.strands.bust, state.mesh);
    state.head.shadow_lift_m = kSkinLift * state.lattice.view().soft_m;
    place_head(turn.view, state.workers, state.head);
  }
  state.bins.bin_boxes(state.head.box, grid);
  return {};
}

Status draw_tiles(TileState& state, RenderTurn& turn) {
  Image& image = state.picture.image;
  image.width = turn.size_px.x;
  image.height = turn.size_px.y;
  image.rgba.resize(size_t{image.width} * image.height * 4);
  const DebugView debug_view = turn.terms.debug_view;
  if (debug_view == DebugView::Density) {
    draw_density(state.lattice.view(), turn.view, state.workers, image);
    return {};
  }
  // Layers are counted over nothing.
  const bool is_bare = debug_view == DebugView::Overdraw;
  const HeadPicture no_head;
  TileInput input{&state.points,     &state.bins,      is_bare ? &no_head : &state.head,
                  &state.shade,      {turn.size_px},   is_bare ? glm::vec3(0.0f) : state.look.background,
                  state.srgb.data(), image.rgba.data()};
  if (turn.terms.backdrop != nullptr && !is_bare) {
    if (state.linear.empty()) state.linear = make_linear_table(state.srgb);
    input.backdrop = turn.terms.backdrop->rgba.data();
    input.linear = state.linear.data();
  }
  std::atomic<bool> is_given_up{false};
  state.workers.at(Priority::Drawing)
      .for_ranges(input.grid.count(), 1, [&](size_t tile, size_t, uint32_t worker) {
        if (worker == 0 && turn.terms.is_unwanted && turn.terms.is_unwanted()) is_given_up = true;
        if (!is_given_up) draw_tile(state.set, {&input, &state.scratch[worker], static_cast<uint32_t>(tile)});
      });
  if (is_given_up) turn.is_whole = false;
  if (debug_view == DebugView::Tiles) mark_tiles(state.bins.segments(), input.grid, image);
  return {};
}

class TileRenderer final : public Renderer {
 public:
  TileRenderer(const SceneAsset& asset, const LookDesc& look, const TileOptions& options)
      : scene_(asset, look, true),
        state_(asset, scene_.look, scene_, options),
        position_count_(asset.rest_position_m.size()),
        points_("points", state_.points),
        lattice_("light lattice", state_.lattice),
        bins_("tiles", state_.bins),
        picture_("picture", state_.picture) {
    const auto add = [&](gl::PassDeclaration declaration, TilePass::Work work) {
      passes_.add(std::make_unique<TilePass>(std::move(declaration), state_, work));
    };
    add({"render/expand", {&scene_.strands}, {&points_}, true, {}}, expand);
    add({"render/light", {&points_}, {&lattice_}, true, {}}, light);
    add({"render/shade", {&points_, &lattice_}, {&points_}, true, {}}, shade);
    add({"render/bin", {&points_}, {&bins_}, true, {}}, bin);
    add({"render/draw", {&points_, &bins_, &lattice_}, {&picture_}, true, {}}, draw_tiles);
  }

  Status plan() { return passes_.plan({&scene_.strands}, {&picture_}); }

  Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
              const DrawTerms& terms) override {
    const glm::uvec2 pixels(size.width, size.height);
    RETURN_IF_ERROR(check_draw(strands, position_count_, size, terms));
    ASSIGN_OR_RETURN(const View view, make_view(camera, strands.world_from_head.rotation, pixels));
    RenderTurn turn(strands, view, pixels, terms);
    RETURN_IF_ERROR(passes_.run(turn, nullptr));
    profile_ = {passes_.last_total_ms(), turn.drawn_strands, turn.drawn_segments, turn.is_whole};
    profile_.left_out_strands = turn.left_out_strands;
    profile_.unusable_segments = turn.unusable_segments;
    return {};
  }
  Status set_look(const LookDesc& look) override {
    state_.look = drawable(look);
    state_.expansion.set_look(state_.look);
    return {};
  }
  Image read_image() override { return state_.picture.image; }
  const RenderProfile& profile() const override { return profile_; }
  const gl::PassListBase& passes() const override { return passes_; }

 private:
  RenderScene scene_;
  TileState state_;
  size_t position_count_;
  Held<StrandPoints> points_;
  Held<LightLattice> lattice_;
  Held<TileBins> bins_;
  Held<HeldImage> picture_;
  RenderPassList passes_;
  RenderProfile profile_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> make_tile_renderer(const SceneAsset& asset, const LookDesc& look,
                                                     const TileOptions& options) {
  RETURN_IF_ERROR(check_asset(asset));
  auto renderer = std::make_unique<TileRenderer>(asset, look, options);
  RETURN_IF_ERROR(renderer->plan());
  return std::unique_ptr<Renderer>(std::move(renderer));
}

}  // namespace strandcast
