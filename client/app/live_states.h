// LiveStates: states of a running server for an export, received as a viewer of strands without display. One
// thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "client/app/live_connection.h"
#include "client/export/export_source.h"

namespace strandcast {

class LiveStates : public ExportSource {
 public:
  /// Joins the server and waits for its first state; `stop` ends every wait.
  static Result<std::unique_ptr<LiveStates>> open(const ClientConfig& config, const std::atomic<bool>& stop);

  const ExportScene& scene() const override { return scene_; }
  /// Waits for a state, also for a server that is away. Returns null once stopped, Timeout if none comes.
  Result<std::shared_ptr<const Snapshot>> next() override;
  Result<std::optional<int64_t>> skip_to(double from_s) override;
  std::optional<CountedState> counted() const override;
  std::vector<std::string> remarks() const override;
  /// Returns the newest look.
  const LookDesc& look() const { return live_->session().look().look; }

 private:
  LiveStates(std::unique_ptr<LiveConnection> live, const std::atomic<bool>& stop);
  Status pump();
  void listen();
  std::optional<CountedState> newest_counted() const;

  std::unique_ptr<LiveConnection> live_;
  const std::atomic<bool>& stop_;
  ExportScene scene_;
  std::optional<CountedState> counted_;                    // with the first state
  std::deque<std::shared_ptr<const Snapshot>> waiting_;    // as much as one pump() brings
  int64_t last_ns_ = std::numeric_limits<int64_t>::min();  // simulated time of the newest
};

}  // namespace strandcast
