#include "tests/fuzz/strand_chain.h"

#include <array>
#include <charconv>
#include <map>
#include <utility>

#include "common/base/check.h"
#include "common/kernels/step_model.h"
#include "common/strands/step/rod_planes.h"
#include "common/strands/strand_payload.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/support/hair_motion.h"

namespace strandcast {
namespace {

using SnapshotPtr = std::shared_ptr<const Snapshot>;

StrandChainWatcher* chain_watcher = nullptr;

constexpr float kBoundM = 1e-4f;
constexpr size_t kFrames = 8;
constexpr size_t kJoinFrame = 3;  // late joiners get a keyframe of this state
constexpr size_t kPayloadLengthAt = 12;

/// Where a strand message has what only who knows it can say. An exact frame begins with its hash.
struct KnownPlaces {
  size_t state_hash, step_check;
};
KnownPlaces places_in(std::span<const std::byte> message) {
  const bool is_exact =
      message.size() > kFrameHeaderBytes && (message[kFrameHeaderBytes] & std::byte{0x80}) != std::byte{0};
  if (is_exact) return {kFrameHeaderBytes + 1, kFrameHeaderBytes + 9};
  return {kFrameHeaderBytes + 88, kFrameHeaderBytes + kStrandFixedBytes + 2};
}

/// The steps bound what an input costs. Slices need 1024 strands; such an input takes as long as ten others,
/// so few have any.
struct HairSize {
  uint32_t strands, vertices;
  int most_steps;
};
constexpr std::array<HairSize, 8> kSizes = {
    {{5, 4, 16}, {1, 2, 24}, {40, 6, 4}, {1024, 2, 3}, {8, 3, 16}, {3, 9, 8}, {20, 2, 12}, {9, 4, 12}}};

constexpr size_t kSliced = 3;
constexpr uint8_t kNotSliced = 0xc0;  // settings

size_t size_index(uint8_t settings) {
  const size_t index = (settings >> 1) % kSizes.size();
  return index == kSliced && (settings & kNotSliced) != 0 ? 0 : index;
}

/// What a good server sends, and what it decodes to.
struct HonestChain {
  StrandStreamLimits limits;
  std::vector<glm::vec3> rest_in_head_m;  // empty: not announced
  std::vector<EncodedFramePtr> frame;     // the first is a keyframe
  EncodedFramePtr joiner;                 // of the state of frame kJoinFrame
  std::vector<SnapshotPtr> decoded;
};

constexpr size_t kOtherSceneFrame = 5;
constexpr size_t kOtherModelFrame = 6;
constexpr size_t kExactFrame = 7;  // the state before once more, as it was decoded

/// A solver and a scene that are about what moves the hair here: "step" predicts by them.
std::shared_ptr<const StepModel> step_model(const HairSize& size, std::span<const glm::vec3> rest_in_head_m,
                                            bool is_rod) {
  constexpr double kBendStiffness = 1.4e-3;   // EI / (rho A) of a hair, m^4/s^2
  constexpr double kTwistStiffness = 1.0e-3;  // GJ / (rho A)
  auto model = std::make_shared<StepModel>();
  model->strand_count = size.strands;
  model->vertex_count = size.vertices;
  model->pinned_root_count = 2;
  model->parameters.air_drag_per_s = 5.0;
  model->parameters.max_speed_mps = 30.0;
  model->parameters.s_damping = 0.9;
  model->kernel.shader_path = is_rod ? "sim/direct_rod.comp" : "sim/dftl.comp";
  if (!is_rod) return model;
  model->kernel.variant = {{"HAS_PINNED_TAIL", 0}, {"HAS_TWIST", 1}};
  model->kernel.constants = {{"u_solves", 1u}, {"u_order", 2u}, {"u_bending_damping", 2e-3}};
  step::RodPlanes rods = step::natural_rods({rest_in_head_m, size.strands, size.vertices, 2, 0, {}, true});
  for (uint32_t s = 0; s < size.strands; ++s) {
    rods.strand[2 * size.strands + s].w = static_cast<float>(kBendStiffness);
    rods.strand[3 * size.strands + s].w = static_cast<float>(kTwistStiffness);
  }
  model->rod_edge = std::move(rods.edge);
  model->rod_strand = std::move(rods.strand);
  return model;
}

/// With all that may act on strands besides.
std::shared_ptr<const StepModel> with_passes(const StepModel& model) {
  auto with = std::make_shared<StepModel>(model);
  with->bend = BendAngles{.most_root_rad = 0.8, .most_tip_rad = 0.8};
  with->drag_along_share = 0.5;
  if (with->rod_strand.empty()) {
    with->pinned_tail_count = 1;
    for (uint32_t s = 0; s < with->strand_count; ++s) with->has_tail.push_back(s % 3 == 0 ? 1 : 0);
  }
  with->meets_body = true;
  ToldField field{{glm::vec3(-0.12f), 0.08f, glm::uvec3(4)}, {}};
  for (int node = 0; node < 64; ++node)
    field.distance.push_back(static_cast<int16_t>(900 * (node % 5) - 1800));
  with->field = std::make_shared<ToldField>(field);
  return with;
}

/// The trails of a chain's states, one after the other.
class Trails {
 public:
  Trails(const HairSize& size, const HairMotion& hair)
      : model_(step_model(size, hair.rest_in_head(), size.strands % 2 == 0)),
        other_model_(with_passes(*step_model(size, hair.rest_in_head(), size.strands % 2 != 0))) {
    auto scene = std::make_shared<StepScene>();
    scene->colliders = {{glm::vec3(0.0f), 0.1f}};
    scene->waves = {{{0.5f, 0.0f, 0.2f}, {1.0f, 0.0f, 6.0f}, 0.3f}};
    scene->follicle_limit_rad = 0.5;
    scene->follicle_cosine = 0.87758f;
    scene->follicle_sine = 0.47943f;
    scene_ = scene;
    scene->substeps = 2;
    scene->body.capsules.resize(1);
    scene->body.planes.resize(1);
    other_scene_ = std::make_shared<StepScene>(*scene);
  }
  std::shared_ptr<const StepTrail> of(const Snapshot& snapshot, size_t frame) {
    constexpr glm::dvec3 kWindMps(0.6, 0.1, 0.2);
    StepTick tick;
    tick.tick = snapshot.tick;
    tick.world_from_head = snapshot.world_from_head;
    tick.wind_mps = kWindMps;
    tick.has_waves = true;
    tick.has_body = frame >= kOtherSceneFrame;
    if (tick.has_body) tick.body_m = {{0.0, -0.1, 0.05}, {0.05, -0.1, 0.001 * static_cast<double>(frame)}};
    ticks_.push_back(tick);
    if (ticks_.size() > kMostTrailTicks) ticks_.erase(ticks_.begin());
    return std::make_shared<StepTrail>(StepTrail{frame < kOtherModelFrame ? model_ : other_model_,
                                                 frame < kOtherSceneFrame ? scene_ : other_scene_, ticks_});
  }

 private:
  std::shared_ptr<const StepModel> model_;
  std::shared_ptr<const StepModel> other_model_;
  std::shared_ptr<const StepScene> scene_;
  std::shared_ptr<const StepScene> other_scene_;
  std::vector<StepTick> ticks_;
};

HonestChain make_chain(const std::string& codec, uint8_t settings) {
  const HairSize size = kSizes[size_index(settings)];
  HairMotion hair({size.strands, size.vertices, MotionKind::Active});
  HonestChain chain;
  chain.limits = {size.strands, size.vertices};
  if ((settings & kWithRestShape) != 0) chain.rest_in_head_m = hair.rest_in_head();
  auto encoder = make_strand_encoder(codec);
  auto decoder = make_strand_decoder(codec, chain.limits);
  CHECK(encoder.ok() && decoder.ok());
  (*encoder)->set_rest_shape(chain.rest_in_head_m);
  (*decoder)->set_rest_shape(chain.rest_in_head_m);
  Trails trails(size, hair);
  for (size_t i = 0; i < kFrames; ++i) {
    hair.step();
    Snapshot snapshot = hair.snapshot(lattice_step_m(codec, kBoundM).value());
    if (i == kExactFrame) snapshot = *chain.decoded.back();
    snapshot.trail = trails.of(snapshot, i);
    if (i == kJoinFrame) {
      JoinFrames frames = (*encoder)->encode_for_join(snapshot);
      chain.frame.push_back(frames.frame);
      chain.joiner = frames.keyframe;
    } else {
      chain.frame.push_back((*encoder)->encode(snapshot));
    }
    const auto decoded = (*decoder)->decode(chain.frame.back()->message);
    CHECK(decoded.ok());
    chain.decoded.push_back(*decoded);
  }
  return chain;
}

const HonestChain& chain_of(const std::string& codec, uint8_t settings) {
  static std::map<std::pair<std::string, int>, HonestChain> chains;
  const int key = static_cast<int>(2 * size_index(settings)) + settings % 2;
  const auto known = chains.find({codec, key});
  if (known != chains.end()) return known->second;
  return chains.emplace(std::pair(codec, key), make_chain(codec, static_cast<uint8_t>(key))).first->second;
}

void check_valid(const Snapshot& snapshot, const StrandStreamLimits& limits) {
  CHECK(snapshot.strand_count >= 1 && snapshot.strand_count <= limits.strand_count);
  CHECK(snapshot.vertex_count == limits.vertex_count);
  CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
  CHECK(snapshot.quantum_m > 0.0f && is_finite(snapshot.world_from_head));
  for (const int32_t value : snapshot.lattice) CHECK(value > -kMaxLattice && value < kMaxLattice);
  for (const glm::vec3& point : positions_in_head(snapshot))
    CHECK(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z));
}

class Game {
 public:
  Game(const std::string& codec, uint8_t settings) : chain_(chain_of(codec, settings)) {
    auto decoder = make_strand_decoder(codec, chain_.limits);
    CHECK(decoder.ok());
    decoder_ = std::move(decoder).value();
    decoder_->set_rest_shape(chain_.rest_in_head_m);
    if (chain_watcher != nullptr) chain_watcher->made(codec, chain_.limits, chain_.rest_in_head_m);
  }

  void honest() {
    const EncodedFramePtr& frame = is_following_ ? chain_.frame[next_] : chain_.joiner;
    if (!is_following_) next_ = kJoinFrame;
    const auto decoded = decode(frame->message);
    CHECK(decoded.ok());
    CHECK((*decoded)->lattice == chain_.decoded[next_]->lattice);
    CHECK(state_hash(**decoded) == state_hash(*chain_.decoded[next_]));
    sequence_ = frame->header.sequence;
    next_ = (next_ + 1) % kFrames;
    is_following_ = true;
  }

  void hostile(ChainStep step, uint8_t flags, std::span<const std::byte> piece) {
    std::vector<std::byte> message = make_message(step, flags, piece);
    if ((flags & kFixLength) != 0 && message.size() >= kFrameHeaderBytes) {
      const auto length = static_cast<uint32_t>(message.size() - kFrameHeaderBytes);
      std::memcpy(message.data() + kPayloadLengthAt, &length, sizeof(length));
    }
    auto decoded = decode(message);
    for (int i = 0; i < 2 && !decoded && (flags & kKnowsHash) != 0; ++i) {
      if (!correct_hash(decoded.error(), message)) break;
      decoded = decode(message);
    }
    if (!decoded) return;
    check_valid(**decoded, chain_.limits);
    sequence_ = unpack_frame_header(message).value().sequence;
    is_following_ = false;
  }

 private:
  Result<SnapshotPtr> decode(std::span<const std::byte> message) {
    auto decoded = decoder_->decode(message);
    if (chain_watcher != nullptr) chain_watcher->decoded(message, decoded);
    return decoded;
  }

  std::vector<std::byte> make_message(ChainStep step, uint8_t flags, std::span<const std::byte> piece) const {
    const std::vector<std::byte>& good = chain_.frame[next_]->message;
    if (step == ChainStep::Whole) return {piece.begin(), piece.end()};
    if (step == ChainStep::Patched) return patched(good, FuzzInput(piece));
    if (step == ChainStep::Spliced) {
      FuzzInput input(piece);
      const size_t offset = input.take<uint16_t>() % (good.size() + 1);
      std::vector<std::byte> message(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(offset));
      const auto rest = input.take_rest();
      message.insert(message.end(), rest.begin(), rest.end());
      return message;
    }
    FrameHeader header = chain_.frame[next_]->header;
    const bool is_keyframe = (flags & kAsKeyframe) != 0;
    header.opcode = is_keyframe ? Opcode::StrandKeyframe : Opcode::StrandDelta;
    header.base_sequence = is_keyframe ? 0 : sequence_;
    header.sequence = sequence_ + 1;
    std::vector<std::byte> payload;
    if (step == ChainStep::Body) {
      const auto fixed =
          std::span(good).first(places_in(good).state_hash + sizeof(uint64_t)).subspan(kFrameHeaderBytes);
      payload.assign(fixed.begin(), fixed.end());
    }
    payload.insert(payload.end(), piece.begin(), piece.end());
    return make_encoded_frame(header, payload)->message;
  }

  static std::vector<std::byte> patched(std::vector<std::byte> message, FuzzInput input) {
    while (!input.is_empty()) {
      const size_t offset = input.take<uint16_t>() % message.size();
      message[offset] ^= static_cast<std::byte>(input.take<uint8_t>());
    }
    return message;
  }

  /// Puts the hash or the check that the error names into the message; false when the error is about
  /// something else.
  static bool correct_hash(const Error& error, std::vector<std::byte>& message) {
    const auto correct = [&](std::string_view mark, auto number, size_t at) {
      const size_t found = error.message.find(mark);
      if (found == std::string::npos || message.size() < at + sizeof number) return false;
      const char* digits = error.message.data() + found + mark.size();
      const auto [end, failure] = std::from_chars(digits, digits + 2 * sizeof number, number, 16);
      CHECK(failure == std::errc() && end == digits + 2 * sizeof number);
      std::memcpy(message.data() + at, &number, sizeof number);
      return true;
    };
    const KnownPlaces places = places_in(message);
    return correct("says of steps has check ", uint16_t{0}, places.step_check) ||
           correct("decodes to state ", uint64_t{0}, places.state_hash);
  }

  const HonestChain& chain_;
  std::unique_ptr<StrandDecoder> decoder_;
  size_t next_ = 0;           // honest frame that comes next
  bool is_following_ = true;  // the decoder's state is the one before that frame
  uint32_t sequence_ = 0;     // last one decoded
};

}  // namespace

void watch_strand_chains(StrandChainWatcher* watcher) {
  chain_watcher = watcher;
}

int fuzz_strand_chain(const std::string& codec, const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  const auto settings = input.take<uint8_t>();
  Game game(codec, settings);
  for (int i = 0; i < kSizes[size_index(settings)].most_steps && !input.is_empty(); ++i) {
    const auto step = static_cast<ChainStep>(input.take<uint8_t>() % kChainStepKinds);
    if (step == ChainStep::Honest) {
      game.honest();
      continue;
    }
    const auto flags = input.take<uint8_t>();
    game.hostile(step, flags, input.take_piece());
  }
  game.honest();
  return 0;
}

}  // namespace strandcast
