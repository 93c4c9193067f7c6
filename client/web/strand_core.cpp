#include "client/web/strand_core.h"

#include <memory>
#include <string>
#include <vector>

#include "client/web/core_export.h"
#include "common/base/worker_pool.h"
#include "common/replay/strand_fill.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"

using namespace strandcast;

struct StrandCoreDecoder {
  StrandStreamLimits limits;
  WorkerPool workers{1};
  std::unique_ptr<StrandDecoder> decoder;
  std::shared_ptr<const Snapshot> newest;
  StrandCoreState state{};
  StrandFill fill;                    // of the asset
  std::vector<glm::vec3> position_m;  // of `newest`, once they are asked for
};

namespace {

StrandCoreState state_of(const Snapshot& snapshot) {
  const glm::dvec3& position_m = snapshot.world_from_head.position_m;
  const glm::dquat& rotation = snapshot.world_from_head.rotation;
  const BustTurn bust = bust_turn(snapshot.bust, rotation);
  return {snapshot.tick,
          snapshot.sim_time_ns,
          snapshot.motion_time_ns,
          {position_m.x, position_m.y, position_m.z},
          {rotation.w, rotation.x, rotation.y, rotation.z},
          snapshot.strand_count,
          snapshot.vertex_count,
          static_cast<uint32_t>(3 * snapshot.plane_size()),
          snapshot.quantum_m,
          {bust.x, bust.y, bust.z}};
}

Status set_asset(StrandCoreDecoder& core, std::span<const std::byte> payload) {
  ASSIGN_OR_RETURN(const SceneAsset asset, decode_asset_strands(payload));
  if (asset.strand_count != core.limits.strand_count || asset.vertex_count != core.limits.vertex_count)
    return make_error(ErrorCode::BadInput, "the asset has {} strands of {} vertices, {} of {} were announced",
                      asset.strand_count, asset.vertex_count, core.limits.strand_count,
                      core.limits.vertex_count);
  core.decoder->set_rest_shape(asset.rest_position_m);
  core.fill = StrandFill(asset.rest_position_m, asset.vertex_count);
  return {};
}

}  // namespace

STRAND_CORE_EXPORT StrandCoreDecoder* strand_core_make(const char* codec, size_t codec_bytes,
                                                       uint32_t strand_count, uint32_t vertex_count) {
  auto core = std::make_unique<StrandCoreDecoder>();
  core->limits = {strand_count, vertex_count};
  auto decoder = make_strand_decoder(std::string(codec, codec_bytes), core->limits, core->workers);
  if (!decoder) {
    remember_core_error(decoder.error());
    return nullptr;
  }
  core->decoder = std::move(decoder).value();
  return core.release();
}
STRAND_CORE_EXPORT void strand_core_delete(StrandCoreDecoder* decoder) {
  delete decoder;
}

STRAND_CORE_EXPORT int strand_core_set_asset(StrandCoreDecoder* decoder, const std::byte* payload,
                                             size_t size_bytes) {
  const Status status = set_asset(*decoder, {payload, size_bytes});
  if (!status) remember_core_error(status.error());
  return status.ok() ? 1 : 0;
}

STRAND_CORE_EXPORT int strand_core_decode(StrandCoreDecoder* decoder, const std::byte* message,
                                          size_t size_bytes) {
  auto decoded = decoder->decoder->decode({message, size_bytes});
  if (!decoded) {
    remember_core_error(decoded.error());
    return 0;
  }
  decoder->newest = std::move(decoded).value();
  decoder->state = state_of(*decoder->newest);
  decoder->position_m.clear();
  return 1;
}

STRAND_CORE_EXPORT const StrandCoreState* strand_core_state(const StrandCoreDecoder* decoder) {
  return decoder->newest == nullptr ? nullptr : &decoder->state;
}
STRAND_CORE_EXPORT const float* strand_core_positions(StrandCoreDecoder* decoder) {
  if (decoder->newest == nullptr) return nullptr;
  if (decoder->position_m.empty()) decoder->position_m = positions_in_head(*decoder->newest);
  return &decoder->position_m.front().x;
}
STRAND_CORE_EXPORT const float* strand_core_all_positions(StrandCoreDecoder* decoder) {
  if (decoder->newest == nullptr) return nullptr;
  decoder->position_m = decoder->fill.positions(*decoder->newest);
  return &decoder->position_m.front().x;
}
STRAND_CORE_EXPORT uint32_t strand_core_position_floats(const StrandCoreDecoder* decoder) {
  return static_cast<uint32_t>(3 * decoder->position_m.size());
}
STRAND_CORE_EXPORT uint64_t strand_core_hash(const StrandCoreDecoder* decoder) {
  return decoder->newest == nullptr ? 0 : state_hash(*decoder->newest);
}
