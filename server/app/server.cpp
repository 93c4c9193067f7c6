#include "server/app/server.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/thread_name.h"
#include "common/base/version.h"
#include "common/base/worker_pool.h"
#include "common/log/log.h"
#include "server/app/head_files.h"
#include "server/app/live_manager.h"
#include "server/app/process_metrics.h"
#include "server/app/served_head.h"
#include "server/app/server_metrics.h"
#include "server/app/server_passes.h"

namespace strandcast {
namespace {

constexpr auto kStatusInterval = std::chrono::milliseconds(500);

/// One for each head, with that and its files alone.
std::vector<ServerConfig> configs_of_heads(const ServerConfig& config) {
  std::vector<SceneDesc> scenes = config.scene.heads;
  scenes.insert(scenes.begin(), config.scene);
  scenes.front().heads.clear();
  std::vector<std::string> names;
  for (const SceneDesc& scene : scenes) names.push_back(scene.name);
  const std::vector<std::string> endings = head_file_endings(names);
  std::vector<ServerConfig> configs(scenes.size(), config);
  for (size_t i = 0; i < scenes.size(); ++i) {
    ServerConfig& own = configs[i];
    own.scene = std::move(scenes[i]);
    if (own.record) own.record->path = with_file_ending(own.record->path, endings[i]);
    if (own.record_folder) own.record_folder->file_ending = endings[i];
    if (!own.trace_path.empty()) own.trace_path = with_file_ending(own.trace_path, endings[i]);
  }
  return configs;
}

}  // namespace

std::string names_of_heads(const SceneDesc& scene) {
  std::string names = scene.name;
  for (const SceneDesc& head : scene.heads) names += ", " + head.name;
  return names;
}

Result<std::unique_ptr<StateSource>> simulation_source(const ServerConfig& config, InputHub& inputs) {
  return make_simulation({config.scene,
                          {config.sim_device, config.gl_device, config.shader_folder},
                          config.on_publish,
                          config.tap,
                          nullptr,
                          config.is_lockstep,
                          config.shared},
                         inputs);
}

class Server::State {
 public:
  explicit State(const ServerConfig& config) : config_(config) {}
  ~State() { stop(); }

  Status start();
  void stop();
  void wait();
  ServerCounters counters(size_t head) const;
  gl::PassReports passes() const { return heads_.front()->passes(); }
  uint16_t port() const { return net_->port(); }
  StreamHub& hub(size_t head) { return heads_[head]->hub(); }
  std::optional<Error> failure() const;
  std::optional<Error> recording_failure() const;
  Status reload_tls() { return net_->reload_tls(); }
  Status set_tokens(std::vector<AccessToken> tokens) { return net_->set_tokens(std::move(tokens)); }
  bool is_shut_down_wanted() const;

 private:
  Status open_live();
  void record(RecordManager& own, const RecordCommand& command) const;
  Status listen();
  void run_status();
  std::vector<PaintedHead> other_heads(size_t own) const;
  std::optional<SceneDesc> scene() const;
  std::string metrics() const;

  const ServerConfig config_;
  std::vector<std::unique_ptr<ServedHead>> heads_;  // the scene's own first
  std::unique_ptr<LiveManager> live_;               // null where the scene asks for none
  std::unique_ptr<RecordManagers> records_;         // of several heads, where they may be recorded
  std::unique_ptr<NetServer> net_;

  std::mutex mutex_;  // guards has_stopped_
  std::condition_variable changed_;
  bool has_stopped_ = false;
  std::thread status_thread_;
};

Status Server::State::start() {
  RETURN_IF_ERROR(NetServer::check_port(config_.net));
  shared_workers();  // no nicer than this thread, as the one that draws is
  for (const ServerConfig& config : configs_of_heads(config_)) {
    ServedHead::OtherHeads others;
    if (!config_.scene.heads.empty()) others = [this, own = heads_.size()] { return other_heads(own); };
    auto head = ServedHead::load(config, heads_.size(), std::move(others));
    if (!head) return config_.scene.heads.empty() ? head.error() : at(config.scene.name, head.error());
    heads_.push_back(std::move(head).value());
  }
  RETURN_IF_ERROR(open_live());
  RETURN_IF_ERROR(listen());
  for (const auto& head : heads_) RETURN_IF_ERROR(head->start(*net_));
  net_->start();
  if (live_ != nullptr) live_->start();
  status_thread_ = std::thread([this] { run_status(); });
  log_info("app", "serving scene '{}' on {} port {}", names_of_heads(config_.scene), config_.net.address,
           net_->port());
  return {};
}

/// What pictures show beside one head.
std::vector<PaintedHead> Server::State::other_heads(size_t own) const {
  std::vector<PaintedHead> others;
  for (size_t i = 0; i < heads_.size(); ++i)
    if (i != own) others.push_back(heads_[i]->painted());
  return others;
}

/// Of all heads, where there are several. Nobody waits for the answer, so the log has it.
void Server::State::record(RecordManager& own, const RecordCommand& command) const {
  const auto reply = [](const Notice& said) {
    if (said.is_error)
      log_warn("record", "{}", said.text);
    else
      log_info("record", "{}", said.text);
  };
  // What anybody on this machine may send ends no file that a person's option began.
  const auto has_take = [](const auto& head) {
    return head->records() != nullptr && head->records()->has_take();
  };
  if (!command.is_wanted && std::none_of(heads_.begin(), heads_.end(), has_take))
    log_warn("record", "a sender ends a take, and none is being recorded");
  else if (records_ != nullptr)
    records_->obey(command, reply);
  else
    own.obey(command, reply);
}

/// The sockets of live motion capture, where any is asked for.
Status Server::State::open_live() {
  std::vector<LiveManager::Target> targets;
  bool is_wanted = false;
  for (const auto& head : heads_) {
    targets.push_back(head->live_target());
    if (heads_.size() > 1) targets.back().head = head->name();
    if (RecordManager* const own = head->records(); own != nullptr)
      targets.back().listener.on_record = [this, own](const RecordCommand& command) {
        record(*own, command);
      };
    is_wanted = is_wanted || !targets.back().live.empty();
  }
  if (!is_wanted) return {};
  ASSIGN_OR_RETURN(live_, LiveManager::open(std::move(targets), config_.live_allowed));
  return {};
}

Status Server::State::listen() {
  ServedHead::Whole whole;
  whole.live = live_.get();
  whole.scene = [this] { return scene(); };
  whole.metrics = [this] { return metrics(); };
  if (heads_.size() > 1)
    for (const auto& head : heads_) {
      whole.heads.push_back(head->name());
      whole.sources.push_back(&head->source());
    }
  if (heads_.size() > 1 && heads_.front()->records() != nullptr) {
    std::vector<RecordManagers::Of> records;
    for (const auto& head : heads_) records.push_back({head->name(), head->records()});
    records_ = std::make_unique<RecordManagers>(std::move(records));
  }
  whole.records = records_.get();
  std::vector<NetHead> heads;
  for (const auto& head : heads_) heads.push_back(head->admit(whole));
  NetConfig net = config_.net;
  net.page = built_in_page();
  ASSIGN_OR_RETURN(net_, NetServer::listen(net, std::move(heads)));
  return {};
}

void Server::State::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(has_stopped_, true)) return;
  }
  changed_.notify_all();
  if (status_thread_.joinable()) status_thread_.join();
  // Viewers first, so that they hear of it; then whoever feeds the next in line.
  if (net_ != nullptr) net_->stop();
  if (live_ != nullptr) live_->stop();
  for (const auto& head : heads_) head->stop();
}

void Server::State::wait() {
  std::unique_lock lock(mutex_);
  while (!has_stopped_ && !is_shut_down_wanted() && !failure()) changed_.wait_for(lock, kStatusInterval);
}

void Server::State::run_status() {
  name_thread("status");
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kStatusInterval, [this] { return has_stopped_; })) {
    lock.unlock();
    for (const auto& head : heads_) head->tell_status();
    lock.lock();
  }
}

std::optional<Error> Server::State::failure() const {
  for (const auto& head : heads_)
    if (auto failure = head->failure()) return heads_.size() > 1 ? at(head->name(), *failure) : failure;
  return std::nullopt;
}

std::optional<Error> Server::State::recording_failure() const {
  for (const auto& head : heads_)
    if (head->records() != nullptr)
      if (auto failure = head->records()->failure()) return failure;
  return std::nullopt;
}

bool Server::State::is_shut_down_wanted() const {
  return std::any_of(heads_.begin(), heads_.end(),
                     [](const auto& head) { return head->is_shut_down_wanted(); });
}

ServerCounters Server::State::counters(size_t head) const {
  ServerCounters counters = heads_[head]->counters();
  counters.net = net_->counters();
  return counters;
}

/// As it runs, with all heads.
std::optional<SceneDesc> Server::State::scene() const {
  std::optional<SceneDesc> whole = heads_.front()->scene();
  for (size_t i = 1; i < heads_.size() && whole; ++i) {
    std::optional<SceneDesc> head = heads_[i]->scene();
    if (!head) return std::nullopt;
    whole->heads.push_back(std::move(*head));
  }
  return whole;
}

std::string Server::State::metrics() const {
  std::vector<HeadMetrics> all;
  for (const auto& head : heads_)
    all.push_back({head->name(), format_server_metrics(head->counters(), version()),
                   head->stage_metrics() + format_passes(head->passes(), gl::object_counts())});
  return join_metrics(all, format_process_metrics());
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerConfig& config) {
  auto state = std::make_unique<State>(config);
  RETURN_IF_ERROR(state->start());
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

StreamHub& Server::hub(size_t head) {
  return state_->hub(head);
}
uint16_t Server::port() const {
  return state_->port();
}
ServerCounters Server::counters(size_t head) const {
  return state_->counters(head);
}
gl::PassReports Server::passes() const {
  return state_->passes();
}
Status Server::reload_tls() {
  return state_->reload_tls();
}
Status Server::set_tokens(std::vector<AccessToken> tokens) {
  return state_->set_tokens(std::move(tokens));
}
bool Server::is_shut_down_wanted() const {
  return state_->is_shut_down_wanted();
}
std::optional<Error> Server::failure() const {
  return state_->failure();
}
std::optional<Error> Server::recording_failure() const {
  return state_->recording_failure();
}
void Server::stop() {
  state_->stop();
}
void Server::wait() {
  state_->wait();
}

}  // namespace strandcast
