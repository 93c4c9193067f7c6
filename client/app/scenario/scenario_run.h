// ScenarioRun: runs a scenario against a server that it starts or that already runs, and checks its
// expectations. The scenario's time limit bounds every wait. One thread, besides those of its viewers and
// feeds.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "client/app/ctl_commands.h"
#include "client/app/scenario/scenario_feed.h"
#include "client/app/scenario/scenario_result.h"
#include "client/app/scenario/scenario_viewer.h"
#include "client/app/scenario/server_process.h"
#include "common/scene/scenario.h"

namespace strandcast {

struct ScenarioOptions {
  std::optional<CtlTarget> running;  // a server that runs already; none: one is started
  std::filesystem::path server;      // the program that is started
  std::filesystem::path out;         // folder for what failed
  bool renews_goldens = false;       // pictures are written instead of compared
  const std::atomic<bool>* stop = nullptr;
  double state_patience_s = 0.5;  // for viewers, behind steps that are not the last
};

/// Receives every check when it is done.
using CheckListener = std::function<void(const CheckResult&)>;

/// A span of time that was stepped or run, and its measurements.
struct MeasuredSpan {
  double seconds = 0.0;     // simulated where it was stepped, else real
  double realtime = -1.0;   // -1 = not measured
  double feed_pace = -1.0;  // motion time per real time; likewise
  double cpu_share = -1.0;  // of one processor, by the server; likewise
  bool has_waited = false;  // by run_s in lockstep: nothing was simulated
  struct Seen {
    ViewerCounts before;
    ViewerLook after;
  };
  std::map<std::string, Seen> viewers;
};

class ScenarioRun {
 public:
  ScenarioRun(const Scenario& scenario, ScenarioOptions options, CheckListener listener);
  ~ScenarioRun();

  /// Runs all actions in order, until one fails that later ones need.
  ScenarioResult run();

 private:
  struct State {  // of a check under way
    std::string what, wanted, measured;
    bool has_passed = false;
  };
  using Viewers = std::map<std::string, std::unique_ptr<ScenarioViewer>>;

  Status carry_out(const ScenarioAction& action);
  Status carry_out(const ScenarioStart& start);
  Status carry_out(const ScenarioFeed& feed);
  Status carry_out(const ScenarioSteps& steps);
  Status carry_out(const ScenarioRunTime& run);
  Status carry_out(const ScenarioSet& set);
  Status carry_out(ScenarioCommand command);
  Status carry_out(const ScenarioView& view);
  Status carry_out(const ScenarioLeave& leave);
  Status carry_out(const ScenarioRemember& remember);
  Status carry_out(const ScenarioExpect& expect);
  Status carry_out(const ScenarioRefusal& refusal);
  Status carry_out(const ScenarioSend& send);
  Status carry_out(const ScenarioLink& link);
  Status carry_out(const ScenarioDisk& disk);
  Status start_relay();
  Status restart_server();
  void begin_absence(const std::string& viewer);

  // The connection that commands.
  Status connect();
  Result<ClientConfig> config_for(Role role) const;
  Status connect_heads();
  Result<Notice> ask(const ClientMessage& message);
  Result<Notice> ask(ViewerClient& client, const ClientMessage& message);
  void take(const ClientEvent& event);
  Result<std::string> metrics();
  Status start_live_feed();

  Status step_chunk(uint64_t tick);
  void await_viewers(uint64_t tick, double patience_s);
  double server_cpu_s();
  void begin_span();
  void end_span(double seconds, double realtime);
  void trace();

  Result<ScenarioViewer*> viewer(const std::string& name) const;
  void report(const std::string& what, const std::string& wanted, const std::string& measured,
              bool has_passed, const std::string& detail = {});
  void add_guide(double TraceSample::*measure, const char* word, const std::optional<double>& value);
  void expect_span(const ScenarioExpect& expect);
  void expect_stretch(const std::string& name, const MeasuredSpan::Seen& seen, double limit);
  void expect_picture(const ScenarioExpect& expect);
  ViewerPicture still_picture(const ScenarioViewer& who);
  void expect_metric(const ScenarioMetric& metric);
  void expect_back(const ScenarioExpect& expect);
  void expect_pace(const ScenarioExpect& expect);
  void expect_coherence(const std::string& name, const SeenCoherence& seen, const ScenarioExpect& expect);
  void expect_slow_motion(const ScenarioExpect& expect);
  void expect_mode(const ScenarioExpect& expect);
  /// Waits until `condition` holds; returns false if it does not within `seconds`.
  bool await(double seconds, const std::function<bool()>& condition);
  void expect_state(const ScenarioExpect& expect);
  void expect_kept_state(const std::filesystem::path& path);
  void save_evidence();

  double elapsed_s() const;
  double left_s() const { return scenario_.limit_s - elapsed_s(); }
  bool is_stopped() const { return options_.stop != nullptr && *options_.stop; }
  /// Returns an error when the time limit is over or the run is stopped.
  Status go_on() const;

  const Scenario& scenario_;
  const ScenarioOptions options_;
  const CheckListener listener_;
  const int64_t begin_ns_;
  double last_check_s_ = 0.0;
  int line_ = 0;  // of the action under way
  ScenarioResult result_;

  std::filesystem::path folder_;  // of the server's files; made, and removed at the end
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<ServerProcess> relay_;  // that viewers watch; null: the server itself
  bool is_lockstep_ = false;
  std::unique_ptr<ViewerClient> client_;
  std::vector<std::unique_ptr<ViewerClient>> heads_;  // where there are several: of each, to feed and step it
  bool is_admin_ = false;
  std::optional<Error> lost_;  // why that connection is over
  uint64_t tick_ = 0;          // of the last steps
  int64_t acted_ns_ = 0;       // when the last action ended that expects nothing, now_ns()
  std::optional<uint64_t> hash_;
  std::map<std::string, uint64_t> remembered_;
  ServerStatus status_;
  int64_t status_ns_ = 0;  // of its arrival

  Viewers viewers_;
  std::vector<std::string> viewer_order_;
  std::optional<FeedPlan> plan_;  // of now
  std::optional<SteppedFeed> stepped_feed_;
  std::unique_ptr<LiveFeed> live_feed_;
  std::optional<MeasuredSpan> span_;
  const bool measures_cpu_;   // as something is expected of it
  double span_cpu_s_ = -1.0;  // of the server, when the span began
  double span_begin_s_ = 0.0;
  std::map<std::string, ViewerCounts> traced_;
  double traced_s_ = 0.0;
  std::map<std::string, int64_t> absent_since_ns_;  // of viewers whose server or link was changed, now_ns()
  std::set<std::filesystem::path> renewed_;         // goldens
};

/// Returns the value of a line of /metrics, of several heads that of each; none where there is no such line.
std::vector<double> find_metric(const std::string& text, const std::string& name);

/// Draws what a viewer has received, as the viewer's window would.
Result<Image> draw(const ViewerPicture& picture, RenderSize size);

}  // namespace strandcast
