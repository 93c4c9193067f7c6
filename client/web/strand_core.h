// The strand core for scripts: decoders by plain functions over the module's memory, which is all that a page
// shares with it. Whoever calls has one thread. What is given as a pointer and a size is only read during the
// call; what is given back belongs to the decoder and stays until its next call. Memory may grow in every
// call: views of it are made anew behind each.
#pragma once

#include <cstddef>
#include <cstdint>

struct StrandCoreDecoder;

/// What is known of the newest decoded state besides its positions; offsets are what scripts read by.
struct StrandCoreState {
  uint64_t tick;              // 0
  int64_t sim_time_ns;        // 8
  int64_t motion_time_ns;     // 16
  double head_position_m[3];  // 24: world from head
  double head_rotation[4];    // 48: w x y z
  uint32_t strand_count;      // 80
  uint32_t vertex_count;      // 84
  uint32_t position_floats;   // 88: of strand_core_positions()
  float quantum_m;            // 92: of the lattice
  double bust[3];             // 96: how neck and chest are turned against the head: x y z of a quaternion
};
static_assert(sizeof(StrandCoreState) == 120 && offsetof(StrandCoreState, strand_count) == 80);

extern "C" {

/// Memory for what is given to the other functions; nullptr when there is no more.
void* strand_core_allocate(size_t size_bytes);
void strand_core_free(void* memory);

/// A decoder of the codec with this name (the Welcome's) for streams of at most so many strands; nullptr when
/// there is none, and strand_core_error() says why.
StrandCoreDecoder* strand_core_make(const char* codec, size_t codec_bytes, uint32_t strand_count,
                                    uint32_t vertex_count);
void strand_core_delete(StrandCoreDecoder* decoder);

/// The payload of an asset message: its rest shape starts the decoder anew. 1, or 0 and an error.
int strand_core_set_asset(StrandCoreDecoder* decoder, const std::byte* payload, size_t size_bytes);

/// A whole keyframe or delta message. 1, or 0 and an error: the state is then what it was.
int strand_core_decode(StrandCoreDecoder* decoder, const std::byte* message, size_t size_bytes);

/// nullptr before the first decoded message.
const StrandCoreState* strand_core_state(const StrandCoreDecoder* decoder);
/// Head space, m: (vertex_count x strand_count x 3) vertex-major, strand fastest. nullptr before the first
/// decoded message.
const float* strand_core_positions(StrandCoreDecoder* decoder);
/// Of all strands of the asset: those that the state does not have are filled in
/// (common/replay/strand_fill.h). Without an asset as strand_core_positions().
const float* strand_core_all_positions(StrandCoreDecoder* decoder);
/// Of what either gave last.
uint32_t strand_core_position_floats(const StrandCoreDecoder* decoder);
/// Of the newest state, computed from it (proto/WIRE.md); every decoded one had its message's. 0 before the
/// first.
uint64_t strand_core_hash(const StrandCoreDecoder* decoder);

/// What a step of one vertex takes here, ns: for the Hello. 0 where this module has no kernel to try it with.
/// Not in strand_page, which takes no steps.
double strand_core_step_ns();

/// Why the last call that failed did: UTF-8 that ends in 0.
const char* strand_core_error();
/// "bad input", "unavailable" ...: its kind.
const char* strand_core_error_kind();
}
