#include "tests/vopr/disk.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <utility>

#include "common/record/recording_check.h"

namespace strandcast::vopr {
namespace {

/// What is shorter may have been killed before it said what it is.
constexpr uintmax_t kLeastRecordingBytes = 32u << 10;

Recovery recover(const std::filesystem::path& path, const char* what) {
  std::filesystem::path whole = path;
  whole += ".whole";
  std::filesystem::remove(whole);
  const auto recovery = recover_recording(path, whole);
  if (!recovery) world::fail(fmt::format("a recording {} is lost: {}", what, recovery.error().to_string()));
  if (recovery->left_out_chunks > 1 || !recovery->check.is_sound())
    world::fail(fmt::format("of a recording {} {} chunks are lost; {}", what, recovery->left_out_chunks,
                            recovery->check.is_sound() ? "" : recovery->check.problems.front()));
  return *recovery;
}

void flip_a_bit(const std::filesystem::path& path, Random& random) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto at = random.between(0, static_cast<int64_t>(std::filesystem::file_size(path)) - 1);
  file.seekg(at);
  const int byte = file.get() ^ (1 << random.below(8));
  file.seekp(at);
  file.put(static_cast<char>(byte));
}

}  // namespace

Disk& Disk::of(NodeId node) {
  static auto* const disks = new std::map<NodeId, Disk>;
  return (*disks)[node];
}

size_t Disk::take(size_t offered) {
  if (state_ == State::Dying) {
    state_ = State::Dead;
    return world::random().below(static_cast<uint32_t>(offered) + 1);
  }
  const auto fitting = static_cast<size_t>(std::min<uint64_t>(offered, room_bytes_));
  if (room_bytes_ != std::numeric_limits<uint64_t>::max()) room_bytes_ -= fitting;
  was_full_ = was_full_ || fitting < offered;
  return fitting;
}

void Disk::revive() {
  *this = Disk();
}

void lose_a_part(const std::filesystem::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(path) / 2));
  file << std::string(4096, '?');
}

uint64_t check_recovery(const std::filesystem::path& path, Random& random) {
  if (std::filesystem::file_size(path) < kLeastRecordingBytes) return 0;
  const Recovery as_it_is = recover(path, "that was not finished");
  if (as_it_is.left_out_chunks + as_it_is.left_out_frames > 0)
    world::fail("of a recording chunks are lost whose bytes are whole");
  if (as_it_is.cut_bytes == 0 && as_it_is.check.frames > 0) {  // else there is one asset alone
    flip_a_bit(path, random);
    (void)recover(path, "with a flipped bit");
  }
  return as_it_is.check.states;
}

}  // namespace strandcast::vopr
