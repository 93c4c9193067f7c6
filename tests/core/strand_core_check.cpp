// What a relay or a viewer in a browser does with strands, linked with the core alone: a server's chain of
// frames in every codec goes through the replay, and each decoded state has the hash of the one that was
// sent. That this program links, and needs no library but those named in tests/core/check_needed.sh, is half
// of what it proves.
#include <cstdio>
#include <utility>

#include "common/replay/strand_replay.h"
#include "common/strands/scene_asset.h"
#include "tests/support/hair_motion.h"

namespace strandcast {
namespace {

constexpr uint32_t kStrands = 40;
constexpr uint32_t kVertices = 12;
constexpr int kFrames = 20;
constexpr float kBoundM = 1e-4f;
constexpr int64_t kStepNs = 16'666'667;

/// Frames that did not arrive as they were sent; -1 when the codec could not be set up.
int count_wrong_frames(const std::string& codec) {
  HairMotion hair({.strand_count = kStrands, .vertex_count = kVertices});
  const SceneAsset asset{kStrands, kVertices, hair.rest_in_head(), {}, {}};
  const auto received_asset = decode_scene_asset(encode_scene_asset(asset));
  auto encoder = make_strand_encoder(codec);
  auto replay = StrandReplay::make(codec, {kStrands, kVertices}, {});
  const auto quantum_m = lattice_step_m(codec, kBoundM);
  if (!received_asset || !encoder || !replay || !quantum_m) return -1;
  (*encoder)->set_rest_shape(asset.rest_position_m);
  (*replay)->set_rest_shape(received_asset->rest_position_m);
  int wrong = 0;
  for (int i = 0; i < kFrames; ++i) {
    hair.step();
    const Snapshot sent = hair.snapshot(*quantum_m);
    const EncodedFramePtr frame = (*encoder)->encode(sent);
    const auto received = (*replay)->receive(frame->message, i * kStepNs, ClockOffset());
    const auto strands = (*replay)->strands_at(i * kStepNs);
    bool is_right = received != nullptr && strands && strands->position_m.size() == sent.plane_size();
    const std::vector<glm::vec3> sent_m = positions_in_head(sent);
    for (size_t k = 0; is_right && k < sent_m.size(); ++k)
      is_right = glm::distance(sent_m[k], strands->position_m[k]) <= kBoundM;
    wrong += is_right ? 0 : 1;
  }
  return wrong;
}

}  // namespace
}  // namespace strandcast

int main() {
  int failed = 0;
  for (const strandcast::StrandCodecInfo& codec : strandcast::strand_codecs()) {
    const int wrong = strandcast::count_wrong_frames(codec.name);
    std::printf("%s: %d of %d frames wrong\n", codec.name.c_str(), wrong, strandcast::kFrames);
    failed += wrong != 0 ? 1 : 0;
  }
  return failed;
}
