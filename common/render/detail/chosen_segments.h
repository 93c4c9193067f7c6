// Segments of the expanded strands that the camera draws, chosen on the GPU: a list of them, and the indirect
// draws that it takes. To draw them the CPU need not know how many they are. All calls from the context's
// thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"

namespace strandcast {

class ChosenSegments {
 public:
  /// Of at most so many segments.
  explicit ChosenSegments(uint64_t max_segments) : max_segments_(static_cast<uint32_t>(max_segments)) {}
  void allocate();
  /// For the kernel that writes both.
  void bind_for_writing() const;
  /// For draws with a vertex stage that includes the list.
  void bind() const;
  /// Draws for so many segments, were all of them chosen.
  uint32_t draw_count(uint32_t segments) const;
  /// One of them; strands and indices are bound.
  void draw(uint32_t index) const;
  /// Of so many. Waits for the GPU: for who wants to know.
  uint32_t read_count(uint32_t segments) const;
  uint64_t size_bytes() const;

 private:
  uint32_t max_segments_;
  gl::Buffer segment_;  // (max_segments)
  gl::Buffer command_;
};

}  // namespace strandcast
