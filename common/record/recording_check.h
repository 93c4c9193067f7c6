// What can be said of a recording without simulating anything: whether it is whole and sound, a whole file
// made of one that is not, and how two differ. Reads untrusted files. Any thread; takes as long as it takes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/record/byte_source.h"

namespace strandcast {

/// Sentences that are kept of what is wrong; of more only the number is.
inline constexpr size_t kMaxProblems = 20;

struct RecordingCheck {
  uint64_t chunks = 0;
  uint64_t states = 0;
  uint64_t frames = 0;
  uint64_t decoded_frames = 0;  // each with the hash that it announces
  uint64_t equal_states = 0;    // of these, that are the published ones bit for bit; 0: the codec rounds
  uint64_t lost_frames = 0;     // that the recorder said
  uint64_t lost_messages = 0;
  bool is_whole = false;    // it was closed
  bool is_cut_off = false;  // it ends before its end, as one does that is being written
  uint64_t problem_count = 0;
  std::vector<std::string> problems;  // sentences

  bool is_sound() const { return problem_count == 0; }
  /// All that is there is sound, and only the end is missing.
  bool is_sound_so_far() const { return is_cut_off && problem_count == 1; }
};

/// CRCs, order, index against contents, and the strands decoded. An error where there is no recording to look
/// at.
Result<RecordingCheck> check_recording(const std::filesystem::path& path);
Result<RecordingCheck> check_recording(ByteSource& source);

struct Recovery {
  uint64_t kept_chunks = 0;
  uint64_t left_out_chunks = 0;  // damaged
  uint64_t left_out_frames = 0;  // sound, and lost what they build on
  uint64_t cut_bytes = 0;        // at the end
  RecordingCheck check;          // of what was made
};

/// Makes `to` of all chunks of `from` that are sound, with an index, and checks it. `to` must not be there,
/// and bears its name when it is whole. Inputs and steps are kept where the hair is lost.
Result<Recovery> recover_recording(const std::filesystem::path& from, const std::filesystem::path& to);

struct RecordingComparison {
  uint64_t equal_states = 0;
  std::optional<uint64_t> first_different_tick;
  std::string difference;          // what differs there; empty = nothing does
  std::vector<std::string> notes;  // of scene, device and build
  uint64_t compared_frames = 0;    // of the same step, decoded from both
  double max_distance_m = 0.0;     // between a vertex in both
  uint64_t max_distance_tick = 0;
};

Result<RecordingComparison> compare_recordings(const std::filesystem::path& a,
                                               const std::filesystem::path& b);

}  // namespace strandcast
