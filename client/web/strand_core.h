// The strand core for scripts: decoders as plain functions over the module's memory, which is all that it
// shares with a page. One thread. Memory passed as pointer and size is only read during the call. Returned
// memory belongs to the decoder and is valid until its next call. Any call may grow the memory, so scripts
// must make new views of it after each.
#pragma once

#include <cstddef>
#include <cstdint>

struct StrandCoreDecoder;

/// Properties of the newest decoded state except its positions; scripts read them at these offsets.
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

/// Allocates memory for arguments of the other functions; nullptr if there is no more.
void* strand_core_allocate(size_t size_bytes);
void strand_core_free(void* memory);

/// Makes a decoder of the named codec (from the Welcome) for streams of at most `strand_count` strands.
/// Returns nullptr on failure; strand_core_error() says why.
StrandCoreDecoder* strand_core_make(const char* codec, size_t codec_bytes, uint32_t strand_count,
                                    uint32_t vertex_count);
void strand_core_delete(StrandCoreDecoder* decoder);

/// Takes the payload of an asset message; its rest shape resets the decoder. Returns 1, or 0 after an error.
int strand_core_set_asset(StrandCoreDecoder* decoder, const std::byte* payload, size_t size_bytes);

/// Decodes a whole keyframe or delta message. Returns 1, or 0 after an error, when the state is unchanged.
int strand_core_decode(StrandCoreDecoder* decoder, const std::byte* message, size_t size_bytes);

/// Returns the newest state; nullptr before the first decoded message.
const StrandCoreState* strand_core_state(const StrandCoreDecoder* decoder);
/// Returns positions in head space, m: (vertex_count x strand_count x 3), vertex-major, strand fastest.
/// nullptr before the first decoded message.
const float* strand_core_positions(StrandCoreDecoder* decoder);
/// Returns positions of all strands of the asset; strands that the state lacks are filled in
/// (common/replay/strand_fill.h). Without an asset it returns those of strand_core_positions().
const float* strand_core_all_positions(StrandCoreDecoder* decoder);
/// Returns the number of floats in the last array that either function returned.
uint32_t strand_core_position_floats(const StrandCoreDecoder* decoder);
/// Returns the hash computed from the newest state (proto/WIRE.md), which equals its message's; 0 before the
/// first.
uint64_t strand_core_hash(const StrandCoreDecoder* decoder);

/// Returns the cost of a step of one vertex on this machine, ns, for the Hello. 0 if this module has no
/// kernel. Missing in strand_page, which does not simulate.
double strand_core_step_ns();

/// Returns why the last failed call failed, as zero-terminated UTF-8.
const char* strand_core_error();
/// Returns the kind of that error: "bad input", "unavailable" ...
const char* strand_core_error_kind();
}
