// Segments of the expanded strands that the camera draws, chosen on the GPU: a list and its indirect draws.
// The CPU need not know their number. All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"

namespace strandcast {

class ChosenSegments {
 public:
  /// Makes an empty list for at most `max_segments` segments.
  explicit ChosenSegments(uint64_t max_segments) : max_segments_(static_cast<uint32_t>(max_segments)) {}
  void allocate();
  /// Binds list and draws for the kernel that writes them.
  void bind_for_writing() const;
  /// Binds the list for draws whose vertex stage includes it.
  void bind() const;
  /// Returns the number of draws that would be needed if all `segments` were chosen.
  uint32_t draw_count(uint32_t segments) const;
  /// Issues one of the draws; strands and indices must be bound.
  void draw(uint32_t index) const;
  /// Returns how many of `segments` were chosen. Waits for the GPU; for diagnosis.
  uint32_t read_count(uint32_t segments) const;
  uint64_t size_bytes() const;

 private:
  uint32_t max_segments_;
  gl::Buffer segment_;  // (max_segments)
  gl::Buffer command_;
};

}  // namespace strandcast
