// CodecManager: chooses which of the served codecs codes each session's strands, when the session joins and
// when the choice turns out wrong. Network thread.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/app/viewer_codec.h"
#include "server/net/net_server.h"

namespace strandcast {

/// Properties of the simulation that decide which viewers can predict it.
struct SimulatedModel {
  std::string solver;
  double solver_cost = 1.0;  // as ViewerCodecFacts
  uint32_t substeps = 1;
  bool is_paused = false;
  double realtime_factor = 1.0;
};

class CodecManager {
 public:
  struct Served {
    std::vector<StrandCodecInfo> codecs;  // as served_codecs()
    size_t vertices = 0;                  // of all strands
    double states_hz = 60.0;              // steps of the simulation
  };
  explicit CodecManager(Served served) : served_(std::move(served)) {}

  /// Chooses the codec of a joining session. A session that gets strands and may change codec later is
  /// remembered; a relay gets the codec that it asks for.
  ViewerCodec admit(SessionId session, const Hello& hello, const SimulatedModel& model);
  /// Measurements of a session. Pass them often: the manager checks whether the session can still afford its
  /// codec.
  struct Look {
    const LinkState& link;
    const ViewerReport& report;
    const SimulatedModel& model;
    double states_hz = 0.0;  // of its strand class
  };
  std::optional<CodecAnswer> consider(SessionId session, const Look& look, int64_t time_ns);
  void remove(SessionId session) { watches_.erase(session); }

 private:
  ViewerCodecFacts facts(const std::string& wish, double step_ns, const SimulatedModel& model) const;

  Served served_;
  std::map<SessionId, ViewerCodecWatch> watches_;  // of who may get another
};

}  // namespace strandcast
