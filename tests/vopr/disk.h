// Disk: what becomes of bytes that a machine writes into real files: a disk that is full, and bytes that were
// not written yet when the machine was killed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include "tests/vopr/world.h"

namespace strandcast::vopr {

class Disk {
 public:
  static Disk& of(NodeId node);

  /// Of so many bytes as many get there as fit; 0: it is full.
  size_t take(size_t offered);
  void fill_after(uint64_t bytes) { room_bytes_ = bytes; }
  /// What is written from now on is lost, and nobody is told; of the first of it some gets there.
  void die() { state_ = State::Dying; }
  void revive();
  bool is_dead() const { return state_ == State::Dead; }
  bool was_full() const { return was_full_; }

 private:
  enum class State { Alive, Dying, Dead };
  State state_ = State::Alive;
  uint64_t room_bytes_ = std::numeric_limits<uint64_t>::max();
  bool was_full_ = false;
};

/// Some bytes of a file are others.
void lose_a_part(const std::filesystem::path& path);

/// What of a recording must be had again is: all whose bytes are whole, and with any bit flipped all but the
/// part that it is in. A run with a broken one fails. Returns its states.
uint64_t check_recovery(const std::filesystem::path& path, Random& random);

}  // namespace strandcast::vopr
