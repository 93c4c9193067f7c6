// A reader of the stream that is no session: keeps strand frames, states and inputs in memory. What a
// recorder to files would be, as far as the hub is concerned.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "server/stream/stream_reader.h"

namespace strandcast::test {

class FrameRecorder : public StreamReader {
 public:
  void on_strands(const EncodedFramePtr& frame) override {
    const std::lock_guard lock(mutex_);
    frames_.push_back(frame);
  }
  void on_state(const std::shared_ptr<const Snapshot>& state) override {
    const std::lock_guard lock(mutex_);
    state_hashes_.push_back(state_hash(*state));
  }
  void on_motion(uint64_t, const MotionSamples& samples, int64_t) override {
    const std::lock_guard lock(mutex_);
    motion_samples_ += samples.samples.size();
  }

  std::vector<EncodedFramePtr> frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  std::vector<uint64_t> state_hashes() const {
    const std::lock_guard lock(mutex_);
    return state_hashes_;
  }
  size_t motion_samples() const {
    const std::lock_guard lock(mutex_);
    return motion_samples_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<EncodedFramePtr> frames_;
  std::vector<uint64_t> state_hashes_;
  size_t motion_samples_ = 0;
};

}  // namespace strandcast::test
