#include "server/relay/upstream.h"

#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/strands/strand_codec.h"

namespace strandcast {
namespace {

/// The stream that is always open: all strands by the first codec. It brings the asset, look and status too.
constexpr uint16_t kFirstStream = 0;
/// Between two looks at what is needed.
constexpr auto kLookInterval = std::chrono::milliseconds(100);
/// A server that knows relays sends the list of its streams right behind its Welcome.
constexpr int64_t kListNs = 5'000'000'000;
constexpr int64_t kStatusNs = 500'000'000;
constexpr const char* kStartedAnew = "The server was started anew.";
/// Frames that are older say that none come.
constexpr double kMaxFrameAgeS = 2.0;

bool is_of_strands(const FrameHeader& header) {
  return header.opcode == Opcode::StrandKeyframe || header.opcode == Opcode::StrandDelta;
}

std::vector<StrandByteModel> byte_models(const std::vector<std::string>& codecs) {
  std::vector<StrandByteModel> models;
  for (const std::string& codec : codecs) {
    const Result<StrandCodecInfo> info = strand_codec_info(codec);
    models.push_back(info ? info->bytes : StrandByteModel{});
  }
  return models;
}

/// Returns the classes of a list; one where it has none.
std::vector<StrandClass> classes_of(const StreamList& list) {
  return list.classes.empty() ? std::vector<StrandClass>(1) : list.classes;
}

}  // namespace

UpstreamCounters& UpstreamCounters::operator+=(const UpstreamCounters& other) {
  for (const auto field :
       {&UpstreamCounters::streams, &UpstreamCounters::keyframes_asked, &UpstreamCounters::joins_from_chain,
        &UpstreamCounters::reconnects, &UpstreamCounters::received_bytes, &UpstreamCounters::frames,
        &UpstreamCounters::keyframes})
    this->*field += other.*field;
  return *this;
}

void Upstream::connect(NetServer& net, Hooks hooks) {
  net_ = &net;
  hooks_ = std::move(hooks);
}

void Upstream::stop() {
  Links links;
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    links = std::exchange(ended_, {});
    for (auto& [stream_id, stream] : streams_) links.push_back(std::move(stream.link));
    streams_.clear();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (const auto& link : links) link->begin_stop();
}

/// Ends the streams for which `is_over` is true; their threads are joined later.
template <class IsOver>
void Upstream::end_streams(IsOver is_over) {
  for (auto entry = streams_.begin(); entry != streams_.end();) {
    Stream& stream = entry->second;
    if (!is_over(*entry)) {
      ++entry;
      continue;
    }
    counters_.received_bytes += stream.link->received_bytes();
    stream.link->begin_stop();
    ended_.push_back(std::move(stream.link));
    entry = streams_.erase(entry);
  }
}

// ---- of which head ----

void Upstream::follow(const std::string& head) {
  const std::lock_guard lock(mutex_);
  if (is_stopping_ || (head_ == head && !failure_)) return;
  leave_server();
  failure_.reset();
  head_ = head;
  open_stream(kFirstStream);
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

void Upstream::rest() {
  const std::lock_guard lock(mutex_);
  if (!head_) return;
  leave_server();
  failure_.reset();
  head_.reset();
  net_->begin_anew(
      std::vector<StrandClass>(1), std::vector<StrandByteModel>(1), "The server has no such head any more.",
      [] {}, number_);
}

void Upstream::leave_server() {
  end_streams([](const auto&) { return true; });
  is_connected_ = false;
  trouble_.reset();
  welcome_ns_ = 0;
  next_ = {};
}

// ---- what is needed ----

void Upstream::run() {
  name_thread("relay");
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    const int64_t time_ns = now_ns();
    follow_demand(time_ns);
    follow_clock();
    begin_if_complete();
    look_for_list(time_ns);
    repeat_away(time_ns);
    Links ended = std::exchange(ended_, {});
    lock.unlock();
    ended.clear();
    lock.lock();
    if (!is_stopping_) changed_.wait_for(lock, kLookInterval);
  }
}

void Upstream::set_demand(std::set<uint16_t> streams) {
  const std::lock_guard lock(mutex_);
  if (streams == demand_) return;
  demand_ = std::move(streams);
  changed_.notify_all();
}

/// Opens what is needed and ends what has not been for a while.
void Upstream::follow_demand(int64_t time_ns) {
  if (relayed_ == nullptr) return;
  for (const uint16_t stream_id : demand_) {
    if (strand_stream_of(stream_id).codec >= relayed_->streams.codecs.size()) continue;
    if (!streams_.contains(stream_id)) open_stream(stream_id);
    streams_[stream_id].needed_ns = time_ns;
  }
  end_streams([&](const auto& entry) {
    return entry.first != kFirstStream && time_ns - entry.second.needed_ns >= kUnneededStreamNs;
  });
}

/// Viewers measure the clock that frames are stamped with: that of the server above.
void Upstream::follow_clock() {
  const auto first = streams_.find(kFirstStream);
  if (first == streams_.end()) return;
  const ClockOffset clock = first->second.link->clock();
  if (number_ > 0) return;  // all heads there have the clock of the first
  if (!clock.has_value() || clock.offset_ns() == clock_offset_ns_) return;
  clock_offset_ns_ = clock.offset_ns();
  net_->set_clock_offset(clock_offset_ns_);
}

/// An older server takes the relay for a viewer; one that stands still may send it the next time.
void Upstream::look_for_list(int64_t time_ns) {
  if (welcome_ns_ == 0 || !next_.streams.codecs.empty() || time_ns - welcome_ns_ < kListNs) return;
  welcome_ns_ = 0;
  const auto first = streams_.find(kFirstStream);
  if (first == streams_.end()) return;
  first->second.link->lose(at(
      server(), make_error(ErrorCode::Timeout,
                           "no list of streams came within {} s: does this server (version {}) know relays?",
                           kListNs / 1'000'000'000, next_.welcome.server_version)));
}

// ---- streams of strands ----

Hello Upstream::hello_for(uint16_t stream_id) const {
  const StrandStream stream = strand_stream_of(stream_id);
  Hello hello;
  hello.name = "relay";
  hello.token = config_.token;
  hello.relay_id = id_;
  hello.head = head_.value_or(std::string());
  hello.strand_class = static_cast<uint32_t>(stream.strand_class);
  if (stream.codec > 0) hello.codec_wish = relayed_->streams.codecs[stream.codec];
  return hello;
}

void Upstream::open_stream(uint16_t stream_id) {
  const StreamKey key{stream_id, ++next_number_};
  Stream& stream = streams_[stream_id];
  stream.number = key.number;
  UpstreamLink::Hooks hooks;
  hooks.on_welcome = [this, key](const Welcome& welcome) { return on_welcome(key, welcome); };
  hooks.on_event = [this, key](ClientEvent event) { on_event(key, std::move(event)); };
  hooks.on_lost = [this, key](const Error& error) { return on_lost(key, error); };
  hooks.on_silence = [this, key](bool is_silent) { on_silence(key, is_silent); };
  stream.link =
      std::make_unique<UpstreamLink>(client_config_for(config_, hello_for(stream_id)), std::move(hooks));
}

/// Returns the stream of this link; null when it has another link by now.
Upstream::Stream* Upstream::find(const StreamKey& key) {
  const auto found = streams_.find(key.stream_id);
  return found != streams_.end() && found->second.number == key.number ? &found->second : nullptr;
}

/// Relays must not stand in a ring, nor in too long a row.
Status Upstream::check_way(const Welcome& welcome) const {
  const auto& relays = welcome.relays;
  if (welcome.session_id == id_ || std::find(relays.begin(), relays.end(), id_) != relays.end())
    return make_error(ErrorCode::Unsupported,
                      "this relay stands behind itself: --upstream must lead to the server that simulates");
  if (relays.size() >= kMaxRelays)
    return make_error(ErrorCode::Unsupported,
                      "{} relays stand one behind another already: join one before that", kMaxRelays);
  return {};
}

/// Whether the server there is not the one whose strands were passed on.
bool Upstream::is_another() const {
  return relayed_ != nullptr && relayed_->welcome.session_id != next_.welcome.session_id;
}

Status Upstream::on_welcome(const StreamKey& key, const Welcome& welcome) {
  const std::lock_guard lock(mutex_);
  Stream* stream = find(key);
  if (stream == nullptr) return make_error(ErrorCode::Unavailable, "this stream is not needed any more");
  RETURN_IF_ERROR(check_way(welcome));
  stream->server_id = welcome.session_id;
  stream->chain.clear();
  stream->asked_ns = now_ns();  // the first keyframe comes by itself
  if (key.stream_id != kFirstStream) return {};
  next_ = {welcome, nullptr, {}};
  welcome_ns_ = stream->asked_ns;
  // Who comes back at once waits here for what the server sends now.
  if (is_another()) net_->send_away(kStartedAnew, number_);
  return {};
}

bool Upstream::on_lost(const StreamKey& key, const Error& error) {
  const std::lock_guard lock(mutex_);
  if (find(key) == nullptr) return false;
  if (key.stream_id != kFirstStream) {
    log_debug("relay", "stream {}: {}", key.stream_id, error.to_string());
    return true;
  }
  welcome_ns_ = 0;
  trouble_ = error;
  const bool was_connected = std::exchange(is_connected_, false);
  // A relay serves others: what a person could have mistyped may also come up later.
  if (is_final(error, Standing::Member)) {
    failure_ = error;
    return false;
  }
  // All heads have one server.
  log_line(number_ == 0 ? LogLevel::Warn : LogLevel::Debug, "relay", error.to_string() + "; trying again");
  if (was_connected) tell_away(error, now_ns());
  return true;
}

/// Tells the viewers, once, that the server is away.
void Upstream::tell_away(const Error& error, int64_t since_ns) {
  if (away_since_ns_ != 0) return;
  away_since_ns_ = since_ns;
  net_->broadcast(
      Notice{true, fmt::format("The server is away; this relay tries again: {}", error.to_string())},
      number_);
}

void Upstream::tell_back() {
  if (std::exchange(away_since_ns_, 0) == 0) return;
  status_.away_s = 0.0;
  net_->broadcast(status_, number_);
  net_->broadcast(Notice{false, "The server is back."}, number_);
}

/// As often as the server itself would send a status.
void Upstream::repeat_away(int64_t time_ns) {
  if (away_since_ns_ == 0 || time_ns - away_told_ns_ < kStatusNs) return;
  away_told_ns_ = time_ns;
  status_.away_s = static_cast<double>(time_ns - away_since_ns_) / kNsPerS;
  net_->broadcast(status_, number_);
}

/// What is still open may come to life again; those who watch are told meanwhile.
void Upstream::on_silence(const StreamKey& key, bool is_silent) {
  const std::lock_guard lock(mutex_);
  if (find(key) == nullptr || key.stream_id != kFirstStream || !is_connected_) return;
  if (!is_silent) {
    trouble_.reset();
    tell_back();
    return;
  }
  const Error error =
      make_error(ErrorCode::Timeout, "not connected: nothing has come from {} for {} s", server(),
                 std::chrono::duration_cast<std::chrono::seconds>(kSilentServer).count());
  log_line(number_ == 0 ? LogLevel::Warn : LogLevel::Debug, "relay", error.to_string());
  trouble_ = error;
  tell_away(error, now_ns() - std::chrono::nanoseconds(kSilentServer).count());
}

void Upstream::on_event(const StreamKey& key, ClientEvent event) {
  const std::lock_guard lock(mutex_);
  Stream* stream = find(key);
  if (stream == nullptr) return;
  if (auto* media = std::get_if<MediaEvent>(&event); media != nullptr && is_of_strands(media->header)) {
    if (media->header.stream_id == key.stream_id) on_frame(*stream, std::move(*media));
    return;
  }
  // Whichever link hears first of other streams, its frames of them come later.
  if (const auto* list = std::get_if<StreamList>(&event); list != nullptr && is_of_now(*stream))
    take_list(*list);
  if (key.stream_id == kFirstStream) on_first_event(std::move(event));
}

bool Upstream::is_of_now(const Stream& stream) const {
  return is_connected_ && relayed_ != nullptr && stream.server_id == relayed_->welcome.session_id;
}

/// In the order of the stream, both for those who are there and for those who join.
void Upstream::on_frame(Stream& stream, MediaEvent media) {
  const int64_t time_ns = now_ns();
  const EncodedFramePtr frame = frame_of(std::move(media));
  ++counters_.frames;
  if (frame->header.opcode == Opcode::StrandKeyframe) ++counters_.keyframes;
  stream.chain.add(frame, time_ns);
  if (!is_of_now(stream)) return;
  newest_frame_ns_ = time_ns;
  net_->publish_strands(frame, number_);
}

void Upstream::ask(Stream& stream) {
  const int64_t time_ns = now_ns();
  if (stream.link == nullptr || stream.server_id.empty() || time_ns - stream.asked_ns < kKeyframeAskNs)
    return;
  stream.asked_ns = time_ns;
  ++counters_.keyframes_asked;
  stream.link->request_keyframe();
}

void Upstream::join(SessionId session, uint16_t stream_id) {
  const std::lock_guard lock(mutex_);
  const auto found = streams_.find(stream_id);
  if (found == streams_.end()) return;  // it is opened soon, and begins with a keyframe
  Stream& stream = found->second;
  if (!stream.chain.serves_joiners() || !is_of_now(stream)) return ask(stream);
  ++counters_.joins_from_chain;
  net_->send_chain(session, stream.chain.frames());
}

void Upstream::request_keyframe(uint16_t stream_id) {
  const std::lock_guard lock(mutex_);
  if (const auto found = streams_.find(stream_id); found != streams_.end()) ask(found->second);
}

// ---- what the first stream tells ----

void Upstream::on_first_event(ClientEvent event) {
  if (auto* media = std::get_if<MediaEvent>(&event)) {
    if (media->header.opcode == Opcode::Asset) next_.asset = frame_of(std::move(*media));
    begin_if_complete();
  } else if (auto* list = std::get_if<StreamList>(&event)) {
    next_.streams = std::move(*list);
    begin_if_complete();
  } else if (auto* status = std::get_if<ServerStatus>(&event)) {
    status_ = std::move(*status);
    net_->broadcast(status_, number_);
  } else if (auto* look = std::get_if<LookChange>(&event)) {
    next_.welcome.look = look->look;
    next_.welcome.camera = look->camera;
    if (is_connected_) tell_relayed();
    net_->broadcast(std::move(*look), number_);
  } else if (auto* notice = std::get_if<Notice>(&event)) {
    net_->broadcast(std::move(*notice), number_);
  } else if (const auto* camera = std::get_if<CameraChange>(&event)) {
    hooks_.on_camera(*camera);
  }
}

void Upstream::take_list(const StreamList& list) {
  if (list == relayed_->streams) return;
  const bool has_other_classes = list.classes != relayed_->streams.classes;
  next_.streams = list;
  tell_relayed();
  if (has_other_classes)
    net_->set_strand_classes(
        classes_of(list), list.reason, [] {}, number_);
}

void Upstream::tell_relayed() {
  relayed_ = std::make_shared<const Relayed>(next_);
  hooks_.on_relayed(relayed_);
}

/// Once all is there that viewers are told.
void Upstream::begin_if_complete() {
  const auto first = streams_.find(kFirstStream);
  const bool is_complete = welcome_ns_ != 0 && next_.asset != nullptr && !next_.streams.codecs.empty() &&
                           first != streams_.end() && first->second.link->clock().has_value();
  if (is_connected_ || !is_complete) return;
  if (next_.streams.codecs.size() > kMaxServedCodecs) next_.streams.codecs.resize(kMaxServedCodecs);
  follow_clock();
  hooks_.on_heads(next_.welcome.heads);
  is_connected_ = true;
  trouble_.reset();
  newest_frame_ns_ = now_ns();
  if (relayed_ == nullptr || is_another()) return begin_anew(kStartedAnew);
  if (relayed_->asset->message != next_.asset->message) return begin_anew("The hair has another shape now.");
  ++counters_.reconnects;
  log_info("relay", "{} is back", server());
  take_list(next_.streams);
  tell_relayed();
  tell_back();
}

/// Another server, the same one started anew, or other hair: nothing of before is of use to anybody.
void Upstream::begin_anew(const char* reason) {
  if (relayed_ != nullptr) ++counters_.reconnects;
  log_info("relay", "relaying '{}' of {}, {} strands by {}", next_.welcome.scene_name, server(),
           next_.welcome.strand_count, next_.welcome.codec);
  away_since_ns_ = 0;
  end_streams([](const auto& entry) { return entry.first != kFirstStream; });
  demand_.clear();
  relayed_ = std::make_shared<const Relayed>(next_);
  net_->begin_anew(
      classes_of(next_.streams), byte_models(next_.streams.codecs), reason,
      [this, relayed = relayed_] { hooks_.on_relayed(relayed); }, number_);
}

// ---- how it goes ----

ServerStatus Upstream::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

UpstreamCounters Upstream::counters() const {
  const std::lock_guard lock(mutex_);
  UpstreamCounters counters = counters_;
  counters.streams = streams_.size();
  for (const auto& [stream_id, stream] : streams_) counters.received_bytes += stream.link->received_bytes();
  return counters;
}

std::string Upstream::head() const {
  const std::lock_guard lock(mutex_);
  return head_.value_or(std::string());
}

Status Upstream::connected() const {
  const std::lock_guard lock(mutex_);
  if (is_connected_) return {};
  return make_error(ErrorCode::Unavailable, "This relay has no connection to its server at {}.", server());
}

Status Upstream::readiness() const {
  Status status = connected();
  const std::lock_guard lock(mutex_);
  if (!head_) return {};
  if (!status && trouble_)
    return make_error(ErrorCode::Unavailable, "This relay has no connection to its server: {}",
                      trouble_->to_string());
  if (!status) return status;
  if (trouble_) return *trouble_;
  const double age_s = static_cast<double>(now_ns() - newest_frame_ns_) * 1e-9;
  if (status_.is_paused || age_s < kMaxFrameAgeS) return {};
  return make_error(ErrorCode::Unavailable, "No frame has come from {} for {:.1f} s (limit {} s).", server(),
                    age_s, kMaxFrameAgeS);
}

std::optional<Error> Upstream::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace strandcast
