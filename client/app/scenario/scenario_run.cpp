#include "client/app/scenario/scenario_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <utility>

#include "client/net/http_get.h"
#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/client/datagram_sender.h"
#include "common/scene/scenario_file.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr double kStartTimeoutS = 60.0;   // a large groom is loaded and its kernels are made
constexpr double kAnswerTimeoutS = 30.0;  // a solver is made anew
constexpr double kLastStateS = 2.0;       // for viewers, behind the last step
constexpr int kMostMisses = 3;            // then a viewer is waited for no more
constexpr double kSeenRateHz = 60.0;      // of the states that viewers see while it is stepped
constexpr uint64_t kBlindChunk = 64;      // steps at once where nobody watches
constexpr milliseconds kRunPoll{5};
constexpr milliseconds kRelayPoll{50};
constexpr milliseconds kHttpTimeout{3'000};
constexpr double kTraceS = 0.25;
constexpr double kLifetimeMarginS = 30.0;
constexpr double kBytesPerMb = 1e6;

/// What an action is called in a scenario.
const char* name_of(const ScenarioWork& work) {
  constexpr std::array kNames = {"start", "feed",   "step",   "run_s",    "set",  "command", "view",
                                 "leave", "expect", "refuse", "remember", "send", "link",    "disk"};
  static_assert(kNames.size() == std::variant_size_v<ScenarioWork>);
  return kNames[work.index()];
}

/// Whether what went wrong is in the file, and not in the server.
bool is_of_file(const Error& error) {
  return error.code == ErrorCode::BadInput || error.code == ErrorCode::NotFound;
}

template <class Test>
bool any_work(const Scenario& scenario, const Test& test) {
  return std::any_of(scenario.actions.begin(), scenario.actions.end(),
                     [&](const ScenarioAction& action) { return test(action.work); });
}

}  // namespace

ScenarioRun::ScenarioRun(const Scenario& scenario, ScenarioOptions options, CheckListener listener)
    : scenario_(scenario),
      options_(std::move(options)),
      listener_(std::move(listener)),
      begin_ns_(now_ns()),
      measures_cpu_(any_work(scenario, [](const ScenarioWork& work) {
        const auto* expect = std::get_if<ScenarioExpect>(&work);
        return expect != nullptr && expect->cpu_share_below.has_value();
      })) {
  result_.name = scenario.name;
  result_.about = scenario.about;
}

ScenarioRun::~ScenarioRun() {
  live_feed_.reset();
  viewers_.clear();
  heads_.clear();
  client_.reset();
  relay_.reset();
  server_.reset();
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

double ScenarioRun::elapsed_s() const {
  return static_cast<double>(now_ns() - begin_ns_) * 1e-9;
}

Status ScenarioRun::go_on() const {
  if (is_stopped()) return make_error(ErrorCode::Unavailable, "stopped");
  if (left_s() <= 0.0)
    return make_error(ErrorCode::Timeout, "the scenario's limit of {:g} s is over", scenario_.limit_s);
  return {};
}

ScenarioResult ScenarioRun::run() {
  Status status = options_.running ? connect() : Status();
  if (!status) report("connect", "a server", status.error().to_string(), false);
  for (const ScenarioAction& action : scenario_.actions) {
    if (!status) break;
    line_ = action.line;
    status = go_on();
    if (status) status = carry_out(action);
    if (!std::holds_alternative<ScenarioExpect>(action.work)) acted_ns_ = now_ns();
    if (status) continue;
    report(name_of(action.work), {}, status.error().to_string(), false);
    result_.is_file_wrong = is_of_file(status.error());
  }
  if (result_.failed_count() > 0 && !is_stopped()) save_evidence();
  result_.seconds = elapsed_s();
  return std::move(result_);
}

Status ScenarioRun::carry_out(const ScenarioAction& action) {
  return std::visit([this](const auto& work) { return carry_out(work); }, action.work);
}

Status ScenarioRun::carry_out(const ScenarioStart& start) {
  is_lockstep_ = start.is_lockstep;
  if (options_.running) return {};  // the one that runs is used
  if (server_ != nullptr) return make_error(ErrorCode::BadInput, "a server was started already");
  ASSIGN_OR_RETURN(folder_, make_temporary_folder());
  ServerProcessConfig config{options_.server, {}, folder_, scenario_.limit_s + kLifetimeMarginS};
  if (!start.scene.empty()) config.arguments = {"--scene", start.scene.string()};
  for (const std::string& assignment : start.overrides)
    config.arguments.insert(config.arguments.end(), {"--set", assignment});
  if (start.is_lockstep) config.arguments.emplace_back("--lockstep");
  if (start.records)
    config.arguments.insert(config.arguments.end(),
                            {"--record", (folder_ / "run.mcap").string(), "--record-replace"});
  config.arguments.insert(config.arguments.end(), start.options.begin(), start.options.end());
  server_ = std::make_unique<ServerProcess>(std::move(config));
  RETURN_IF_ERROR(server_->start(std::min(left_s(), kStartTimeoutS), *options_.stop));
  if (start.has_relay) RETURN_IF_ERROR(start_relay());
  return connect();
}

/// A relay of the server, by its viewers' token.
Status ScenarioRun::start_relay() {
  const std::filesystem::path folder = folder_ / "relay";
  std::error_code failure;
  std::filesystem::create_directory(folder, failure);  // the relay says what is wrong with it
  relay_ = std::make_unique<ServerProcess>(
      ServerProcessConfig{options_.server,
                          {"--upstream", fmt::format("127.0.0.1:{}", server_->port()),
                           "--upstream-token-file", server_->token_file().string()},
                          folder,
                          scenario_.limit_s + kLifetimeMarginS});
  return relay_->start(std::min(left_s(), kStartTimeoutS), *options_.stop);
}

Result<ClientConfig> ScenarioRun::config_for(Role role) const {
  CtlTarget target = options_.running.value_or(CtlTarget{});
  const ServerProcess* server = role == Role::Viewer && relay_ != nullptr ? relay_.get() : server_.get();
  if (server != nullptr) {
    target.connect = fmt::format("127.0.0.1:{}", server->port());
    target.token_file = server->token_file();
  } else if (!options_.running) {
    return make_error(ErrorCode::BadInput, "there is no server yet: begin with start, or give --connect");
  }
  target.stop = options_.stop;
  return client_config_for(target, role);
}

Status ScenarioRun::connect() {
  lost_.reset();
  status_ns_ = 0;
  Error refused;
  // Only an admin may steer and feed by one connection, so that the order of the two is kept.
  for (const Role role : {Role::Admin, Role::Controller}) {
    Result<ClientConfig> config = config_for(role);
    if (config) config->hello.gets_no_stream = true;
    auto client =
        config ? ViewerClient::connect(*config) : Result<std::unique_ptr<ViewerClient>>(config.error());
    if (client) {
      client_ = std::move(client).value();
      is_admin_ = role == Role::Admin;
      return {};
    }
    refused = client.error();
  }
  return refused;
}

/// Of several heads each has a connection, on which samples and steps come in order.
Status ScenarioRun::connect_heads() {
  if (!heads_.empty()) return {};
  for (const std::string& name : client_->welcome().heads) {
    ASSIGN_OR_RETURN(ClientConfig config, config_for(is_admin_ ? Role::Admin : Role::Controller));
    config.hello.gets_no_stream = true;
    config.hello.head = name;
    ASSIGN_OR_RETURN(auto head, ViewerClient::connect(config));
    heads_.push_back(std::move(head));
  }
  return {};
}

void ScenarioRun::take(const ClientEvent& event) {
  if (const auto* closed = std::get_if<ClosedEvent>(&event)) lost_ = closed->error;
  if (const auto* status = std::get_if<ServerStatus>(&event)) {
    status_ = *status;
    status_ns_ = now_ns();
  }
}

Result<Notice> ScenarioRun::ask(const ClientMessage& message) {
  if (client_ == nullptr) return make_error(ErrorCode::BadInput, "there is no server yet: begin with start");
  return ask(*client_, message);
}

/// The answer to a command. Notices that came before it are no answer.
Result<Notice> ScenarioRun::ask(ViewerClient& client, const ClientMessage& message) {
  for (const ClientEvent& event : client.poll()) take(event);
  if (lost_) return *lost_;
  RETURN_IF_ERROR(client.send(message));
  const auto* command = std::get_if<ControlCommand>(&message);
  const bool is_counted = command != nullptr && command->step_count > 0;
  const double end_s = elapsed_s() + (is_counted ? left_s() : std::min(left_s(), kAnswerTimeoutS));
  while (elapsed_s() < end_s) {
    RETURN_IF_ERROR(go_on());
    for (const ClientEvent& event : client.wait(milliseconds(20))) {
      take(event);
      const auto* notice = std::get_if<Notice>(&event);
      if (notice != nullptr && (notice->is_error || !is_counted || notice->tick > 0)) return *notice;
    }
    if (lost_) return *lost_;
  }
  return make_error(ErrorCode::Timeout, "the server did not answer in time");
}

Status ScenarioRun::carry_out(const ScenarioFeed& feed) {
  ASSIGN_OR_RETURN(FeedPlan plan, plan_of(feed));
  live_feed_.reset();
  stepped_feed_.reset();
  plan_.reset();
  if (!plan.motion && !plan.wind) return {};
  plan_ = std::move(plan);
  if (!is_lockstep_) return start_live_feed();
  if (!is_admin_)
    return make_error(
        ErrorCode::Unauthorized,
        "to feed a server in lockstep takes an admin's token (--token-file), so that samples and "
        "steps come in order");
  stepped_feed_.emplace(*plan_, tick_, client_->welcome().step_rate_hz);
  return {};
}

Status ScenarioRun::start_live_feed() {
  live_feed_.reset();
  if (!plan_ || is_lockstep_) return {};
  ASSIGN_OR_RETURN(ClientConfig config, config_for(Role::Source));
  ASSIGN_OR_RETURN(live_feed_, LiveFeed::start(*plan_, config));
  return {};
}

Status ScenarioRun::step_chunk(uint64_t tick) {
  std::vector<ClientMessage> samples;
  if (stepped_feed_) samples = stepped_feed_->samples_up_to(tick);
  const ControlCommand steps{Command::StepOnce, static_cast<uint32_t>(tick - tick_)};
  RETURN_IF_ERROR(connect_heads());
  const auto step = [&](ViewerClient& client) -> Result<Notice> {
    for (const ClientMessage& message : samples) RETURN_IF_ERROR(client.send(message));
    ASSIGN_OR_RETURN(Notice notice, ask(client, steps));
    if (notice.is_error && !is_lockstep_)
      return make_error(
          ErrorCode::BadInput,
          "steps need start {{ lockstep: true }}, or command: PAUSE before them; the server says: {}",
          notice.text);
    if (notice.is_error) return make_error(ErrorCode::Unavailable, "the server says: {}", notice.text);
    return notice;
  };
  for (size_t i = 1; i < heads_.size(); ++i) RETURN_IF_ERROR(step(*heads_[i]));
  ASSIGN_OR_RETURN(const Notice notice, step(heads_.empty() ? *client_ : *heads_.front()));
  tick_ = notice.tick;
  hash_ = notice.state_hash;
  return {};
}

/// Whoever has a good link sees each of these states: what is measured is then the same every time.
void ScenarioRun::await_viewers(uint64_t tick, double patience_s) {
  const double end_s = elapsed_s() + std::min(patience_s, left_s());
  const auto has_seen = [&](const auto& viewer) {
    const ViewerLook look = viewer.second->look();
    const bool is_waited_for = viewer.second->view().link_mbit <= 0.0 && look.is_connected &&
                               look.mode == StreamMode::Strands && viewer.second->view().mode != "frames";
    return !is_waited_for || look.tick + look.rate_divisor > tick;
  };
  while (!std::all_of(viewers_.begin(), viewers_.end(), has_seen) && elapsed_s() < end_s && !is_stopped())
    std::this_thread::sleep_for(milliseconds(1));
}

Status ScenarioRun::carry_out(const ScenarioSteps& steps) {
  if (client_ == nullptr) return make_error(ErrorCode::BadInput, "there is no server yet: begin with start");
  const double rate_hz = client_->welcome().step_rate_hz;
  const auto seen_chunk = static_cast<uint64_t>(std::max(1.0, std::round(rate_hz / kSeenRateHz)));
  const uint64_t chunk = viewers_.empty() ? kBlindChunk : seen_chunk;
  begin_span();
  const double begin_s = elapsed_s();
  int misses = 0;
  for (uint64_t left = steps.count; left > 0;) {
    const uint64_t count = std::min(left, chunk);
    RETURN_IF_ERROR(step_chunk(tick_ + count));
    left -= count;
    const double waits_s = elapsed_s();
    if (misses < kMostMisses) await_viewers(tick_, options_.state_patience_s);
    if (elapsed_s() - waits_s >= options_.state_patience_s) ++misses;
    trace();
  }
  await_viewers(tick_, kLastStateS);
  const double seconds = static_cast<double>(steps.count) / rate_hz;
  end_span(seconds, seconds / std::max(elapsed_s() - begin_s, 1e-6));
  result_.hashes.push_back(*hash_);
  return {};
}

Status ScenarioRun::carry_out(const ScenarioRunTime& run) {
  if (client_ == nullptr) return make_error(ErrorCode::BadInput, "there is no server yet: begin with start");
  begin_span();
  const FeedProgress fed = live_feed_ != nullptr ? live_feed_->progress() : FeedProgress{};
  const double begin_s = elapsed_s();
  uint64_t first_tick = 0;
  int64_t first_ns = 0;
  status_ns_ = 0;
  while (elapsed_s() - begin_s < run.seconds) {
    RETURN_IF_ERROR(go_on());
    for (const ClientEvent& event : client_->wait(kRunPoll)) take(event);
    if (lost_) return *lost_;
    if (first_ns == 0 && status_ns_ != 0) {
      first_tick = status_.tick;
      first_ns = status_ns_;
    }
    trace();
  }
  double realtime = -1.0;
  if (status_ns_ > first_ns && first_ns != 0)
    realtime = static_cast<double>(status_.tick - first_tick) / client_->welcome().step_rate_hz /
               (static_cast<double>(status_ns_ - first_ns) * 1e-9);
  end_span(elapsed_s() - begin_s, realtime);
  span_->has_waited = is_lockstep_;
  const FeedProgress now = live_feed_ != nullptr ? live_feed_->progress() : FeedProgress{};
  if (now.elapsed_s > fed.elapsed_s)
    span_->feed_pace = (now.motion_s - fed.motion_s) / (now.elapsed_s - fed.elapsed_s);
  return {};
}

/// Nobody answers datagrams: their effect shows in /metrics and in what viewers see meanwhile.
Status ScenarioRun::carry_out(const ScenarioSend& send) {
  if (client_ == nullptr) return make_error(ErrorCode::BadInput, "there is no server yet: begin with start");
  std::vector<std::vector<std::byte>> datagrams = send.datagrams;
  for (const std::filesystem::path& file : send.files) {
    ASSIGN_OR_RETURN(std::vector<std::byte> bytes, load_file(file, kMaxScenarioDatagramBytes));
    datagrams.push_back(std::move(bytes));
  }
  if (send.random_bytes > 0) datagrams.emplace_back(send.random_bytes);
  ASSIGN_OR_RETURN(const ClientConfig config, config_for(Role::Viewer));
  ASSIGN_OR_RETURN(const auto sender, DatagramSender::open({config.address.host, send.port}));
  begin_span();
  const double begin_s = elapsed_s();
  uint64_t sent = 0;
  uint32_t random = 0;
  for (uint32_t i = 0; i < send.count; ++i) {
    if (send.random_bytes > 0)
      for (std::byte& byte : datagrams.back()) byte = static_cast<std::byte>(mix_u32(++random));
    for (const std::vector<std::byte>& datagram : datagrams) {
      // One that is too large for the link is refused here already: it is for others to count.
      (void)sender->send(datagram);
      const double due_s = begin_s + static_cast<double>(++sent) / send.rate_hz;
      while (elapsed_s() < due_s) {
        RETURN_IF_ERROR(go_on());
        for (const ClientEvent& event : client_->wait(milliseconds(1))) take(event);
        if (lost_) return *lost_;
      }
      trace();
    }
  }
  end_span(elapsed_s() - begin_s, -1.0);
  return {};
}

/// Processor time that the server has taken; -1 where nothing is expected of it, or it does not say.
double ScenarioRun::server_cpu_s() {
  if (!measures_cpu_) return -1.0;
  const auto text = metrics();
  if (!text) return -1.0;
  const std::vector<double> found = find_metric(*text, "process_cpu_seconds_total");
  return found.empty() ? -1.0 : found.front();
}

void ScenarioRun::begin_span() {
  span_.emplace();
  span_cpu_s_ = server_cpu_s();
  span_begin_s_ = elapsed_s();
  for (const auto& [name, viewer] : viewers_) {
    viewer->begin_measure();
    span_->viewers[name].before = viewer->look().counts;
  }
}

void ScenarioRun::end_span(double seconds, double realtime) {
  span_->seconds = seconds;
  span_->realtime = realtime;
  const double cpu_s = server_cpu_s();
  if (cpu_s >= span_cpu_s_ && span_cpu_s_ >= 0.0)
    span_->cpu_share = (cpu_s - span_cpu_s_) / std::max(elapsed_s() - span_begin_s_, 1e-6);
  for (auto& [name, seen] : span_->viewers)
    if (const auto found = viewers_.find(name); found != viewers_.end()) seen.after = found->second->look();
}

void ScenarioRun::trace() {
  const double time_s = elapsed_s();
  const double passed_s = time_s - traced_s_;
  if (passed_s < kTraceS || result_.trace.size() >= kMaxTraceSamples) return;
  traced_s_ = time_s;
  const double shown_s =
      is_lockstep_ && client_ ? static_cast<double>(tick_) / client_->welcome().step_rate_hz : time_s;
  for (const auto& [name, viewer] : viewers_) {
    const ViewerLook look = viewer->look();
    const ViewerCounts& before = traced_[name];
    TraceSample sample{shown_s, name};
    sample.stretch = look.largest_stretch;
    sample.hz = static_cast<double>(look.counts.frames - before.frames) / passed_s;
    sample.kbit = static_cast<double>(look.counts.received_bytes - before.received_bytes) * kBitsPerByte *
                  1e-3 / passed_s;
    traced_[name] = look.counts;
    result_.trace.push_back(sample);
  }
  if (status_ns_ == 0 || is_lockstep_) return;
  TraceSample sample{shown_s, {}};
  sample.realtime = status_.realtime_factor;
  result_.trace.push_back(sample);
}

Status ScenarioRun::carry_out(const ScenarioSet& set) {
  ASSIGN_OR_RETURN(const Notice notice, ask(SetParameter{set.assignment}));
  if (notice.is_error)
    return make_error(ErrorCode::BadInput, "the server refused {}: {}", excerpt(set.assignment, 100),
                      notice.text);
  return {};
}

Status ScenarioRun::carry_out(ScenarioCommand command) {
  if (command == ScenarioCommand::Restart) return restart_server();
  if (command != ScenarioCommand::RestartRelay) {
    const Command wanted = command == ScenarioCommand::Pause    ? Command::Pause
                           : command == ScenarioCommand::Resume ? Command::Resume
                                                                : Command::Reset;
    ASSIGN_OR_RETURN(const Notice notice, ask(ControlCommand{wanted}));
    if (notice.is_error) return make_error(ErrorCode::Unavailable, "the server says: {}", notice.text);
    return {};
  }
  if (relay_ == nullptr)
    return make_error(ErrorCode::BadInput, "there is no relay to be killed: start {{ relay: true }}");
  RETURN_IF_ERROR(relay_->restart(std::min(left_s(), kStartTimeoutS), *options_.stop));
  for (const auto& [name, viewer] : viewers_) begin_absence(name);
  return {};
}

/// Killed, and started again on the same port.
Status ScenarioRun::restart_server() {
  if (server_ == nullptr)
    return make_error(ErrorCode::BadInput, "a server that was not started by the scenario is not killed");
  live_feed_.reset();
  client_.reset();
  heads_.clear();
  RETURN_IF_ERROR(server_->restart(std::min(left_s(), kStartTimeoutS), *options_.stop));
  for (const auto& [name, viewer] : viewers_) begin_absence(name);
  tick_ = 0;
  hash_.reset();
  RETURN_IF_ERROR(connect());
  if (stepped_feed_) stepped_feed_.emplace(*plan_, 0, client_->welcome().step_rate_hz);
  return start_live_feed();
}

/// From now on it is waited for.
void ScenarioRun::begin_absence(const std::string& viewer) {
  absent_since_ns_[viewer] = now_ns();
  viewers_[viewer]->begin_absence();
}

Status ScenarioRun::carry_out(const ScenarioLink& link) {
  ASSIGN_OR_RETURN(ScenarioViewer* const who, viewer(link.viewer));
  who->change_link(link);
  begin_absence(who->view().name);
  return {};
}

Status ScenarioRun::carry_out(const ScenarioDisk& disk) {
  if (server_ == nullptr)
    return make_error(ErrorCode::BadInput,
                      "the disk of a server that was not started by the scenario is not filled");
  std::optional<uint64_t> most_bytes;
  if (disk.full_at_mb) most_bytes = static_cast<uint64_t>(*disk.full_at_mb * kBytesPerMb);
  return server_->limit_files(most_bytes);
}

Status ScenarioRun::carry_out(const ScenarioView& view) {
  if (viewers_.contains(view.name))
    return make_error(ErrorCode::BadInput, "there is a viewer '{}' already", view.name);
  ASSIGN_OR_RETURN(ClientConfig config, config_for(Role::Viewer));
  // Each of these stands alone: what was sent before does not show in it.
  if (is_lockstep_) config.hello.picture_codecs = codec_bit(PictureCodec::Jpeg);
  ViewerTask task;
  task.has_changing_link = any_work(
      scenario_, [](const ScenarioWork& work) { return std::holds_alternative<ScenarioLink>(work); });
  task.measures_coherence = any_work(scenario_, [](const ScenarioWork& work) {
    const auto* expect = std::get_if<ScenarioExpect>(&work);
    return expect != nullptr && (expect->order_above || expect->incoherent_below);
  });
  auto viewer = ScenarioViewer::join(view, config, task);
  // A relay listens before it has found its server.
  const double end_s = elapsed_s() + (relay_ != nullptr ? kStartTimeoutS : 0.0);
  while (!viewer && elapsed_s() < end_s && go_on()) {
    std::this_thread::sleep_for(kRelayPoll);
    viewer = ScenarioViewer::join(view, config, task);
  }
  ASSIGN_OR_RETURN(viewers_[view.name], std::move(viewer));
  viewer_order_.push_back(view.name);
  // Until it has something to show it has not arrived.
  const ScenarioViewer& joined = *viewers_[view.name];
  while (joined.look().counts.frames == 0) {
    RETURN_IF_ERROR(go_on());
    std::this_thread::sleep_for(kRunPoll);
  }
  return {};
}

Status ScenarioRun::carry_out(const ScenarioLeave& leave) {
  if (viewers_.erase(leave.viewer) == 0)
    return make_error(ErrorCode::BadInput, "there is no viewer '{}'", leave.viewer);
  std::erase(viewer_order_, leave.viewer);
  return {};
}

Status ScenarioRun::carry_out(const ScenarioRemember& remember) {
  if (!hash_) return make_error(ErrorCode::BadInput, "only a state that step led to can be remembered");
  remembered_[remember.name] = *hash_;
  return {};
}

Result<std::string> ScenarioRun::metrics() {
  const Role role = is_admin_ ? Role::Admin : Role::Controller;
  ASSIGN_OR_RETURN(const ClientConfig config, config_for(role));
  ASSIGN_OR_RETURN(const HttpAnswer answer, http_get(config.address, "/metrics", kHttpTimeout,
                                                     {config.tls_authorities, config.hello.token}));
  constexpr unsigned kHttpOk = 200;
  if (answer.status != kHttpOk)
    return make_error(ErrorCode::Unavailable, "/metrics was answered with status {}", answer.status);
  return answer.body;
}

}  // namespace strandcast
