#include "server/input/live/live_source.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "server/input/input_hub.h"

namespace strandcast {
namespace {

constexpr double kJitterShare = 1.0 / 16.0;  // of the newest packet, as in RFC 3550
constexpr size_t kMaxNotes = 32;             // until they are taken
constexpr size_t kMaxNoteChars = 200;

/// What a protocol gives no name is the head that it is about (VMC: the performer's, beside trackers by
/// name); else "head" in whatever case, of a skeleton too ("Actor/Head").
bool is_head(std::string name) {
  name.erase(0, name.rfind('/') + 1);
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.empty() || name == "head";
}

const LiveProtocol* find_protocol(const std::string& name) {
  for (const LiveProtocol& protocol : live_protocols())
    if (name == protocol.name) return &protocol;
  return nullptr;
}

LiveParserConfig parser_config(const LiveDesc& live) {
  LiveParserConfig config;
  config.protocol = live.protocol;
  config.axis_order = live.axes;
  config.protocol_version = live.version;
  config.ignores_zero_positions = !live.takes_zero_positions;
  config.max_datagram_bytes = live.max_datagram_bytes;
  return config;
}

/// Scales a pose to metres and to the size of this head.
LivePose scaled(LivePose pose, double scale) {
  if (scale == 1.0) return pose;
  pose.world_from_subject.position_m *= scale;
  for (glm::dvec3& place_m : pose.joint_m) place_m *= scale;
  return pose;
}

std::string shown(const std::string& name) {
  return name.empty() ? "(no name)" : name;
}

}  // namespace

Result<std::unique_ptr<LiveSource>> LiveSource::make(const LiveDesc& live, size_t index) {
  const std::string field = fmt::format("live.{}", index);
  const LiveParserConfig config = parser_config(live);
  const auto tried = make_live_parser(config);
  if (!tried) return at(field, tried.error());
  const LiveProtocol* protocol = find_protocol(live.protocol);
  CHECK(protocol != nullptr);
  const bool can_ask = protocol->transport == LiveTransport::Tcp || protocol->request_port != 0;
  if (protocol->transport == LiveTransport::Tcp && live.host.empty())
    return make_error(ErrorCode::BadInput,
                      "{}.host: {} is asked for, not waited for: name its server (--mocap {}://HOST)", field,
                      protocol->name, protocol->name);
  const bool has_group = *protocol->multicast_group != '\0';
  if (!can_ask && !has_group && !live.host.empty())
    return make_error(
        ErrorCode::BadInput,
        "{}.host: senders of {} are waited for: let '{}' send to port {} here, and leave host out", field,
        protocol->name, excerpt(live.host, kMaxNoteChars), protocol->default_port);
  return std::unique_ptr<LiveSource>(new LiveSource(live, *protocol, config));
}

LiveSource::LiveSource(const LiveDesc& live, const LiveProtocol& protocol, LiveParserConfig parser)
    : live_(live),
      protocol_(protocol),
      port_(live.port != 0 ? static_cast<uint16_t>(live.port) : protocol.default_port),
      parser_config_(std::move(parser)),
      policy_(live.turns_only),
      packet_allowance_(kMaxSampleBurst),
      byte_allowance_(kMaxLiveBytesPerS) {
  begin_connection();
}

std::string LiveSource::describe() const {
  const std::string host = excerpt(live_.host, kMaxAddressChars);
  if (protocol_.transport == LiveTransport::Tcp)
    return fmt::format("{} of {}:{}", protocol_.name, host, port_);
  return host.empty() ? fmt::format("{} on port {}", protocol_.name, port_)
                      : fmt::format("{} of {} on port {}", protocol_.name, host, port_);
}

// ---- who is heard

void LiveSource::begin_connection() {
  auto parser = make_live_parser(parser_config_);
  CHECK(parser.ok());  // it could be made before
  parser_ = std::move(*parser);
}

bool LiveSource::is_heard(int64_t now_ns) const {
  return is_locked_ && now_ns - packet_ns_ <= kMotionStaleNs;
}

bool LiveSource::take_allowance(size_t bytes, int64_t arrival_ns) {
  const double passed_s = static_cast<double>(std::max<int64_t>(arrival_ns - allowance_ns_, 0)) * kSPerNs;
  if (allowance_ns_ != 0) {
    packet_allowance_ = std::min(packet_allowance_ + passed_s * kMaxSampleRateHz, kMaxSampleBurst);
    byte_allowance_ = std::min(byte_allowance_ + passed_s * kMaxLiveBytesPerS, kMaxLiveBytesPerS);
  }
  allowance_ns_ = arrival_ns;
  const auto size = static_cast<double>(bytes);
  if (packet_allowance_ < 1.0 || byte_allowance_ < size) return false;
  packet_allowance_ -= 1.0;
  byte_allowance_ -= size;
  return true;
}

/// Names are checked where a file is made.
void LiveSource::wish(const LiveTake& take) {
  if (recordings_.size() == kMaxWaitingRecordings) {
    ++counters_.over_rate;
    return;
  }
  if (take.take > kMaxTake && notes_.size() < kMaxNotes)
    notes_.push_back({true,
                      fmt::format("{}: a sender wants take {}: takes go up to {}, and it is recorded as that",
                                  describe(), take.take, kMaxTake),
                      LiveNoteKind::Recording});
  recordings_.push_back(
      {take.is_wanted, {}, printable(take.slate, kMaxSlateChars), std::min(take.take, kMaxTake)});
}

Status LiveSource::take(const std::string& sender, std::span<const std::byte> bytes, int64_t arrival_ns) {
  if (const auto wanted = parser_->take_of(bytes)) {
    if (take_allowance(bytes.size(), arrival_ns))
      wish(*wanted);
    else
      ++counters_.over_rate;
    return {};
  }
  if (const std::string unknown = parser_->unknown_command_of(bytes); !unknown.empty()) {
    if (!take_allowance(bytes.size(), arrival_ns))
      ++counters_.over_rate;
    else
      warn(fmt::format("{} sends {}", sender, unknown));
    return {};
  }
  if (is_heard(arrival_ns) && sender != sender_) {
    ++counters_.refused;
    if (sender != other_sender_ && notes_.size() < kMaxNotes)
      notes_.push_back({true,
                        fmt::format("{}: {} sends too, and is not heard before {} has stopped", describe(),
                                    sender, sender_),
                        LiveNoteKind::Other});
    other_sender_ = sender;
    return {};
  }
  // Who was heard is forgotten, with what it said.
  if (is_locked_ && !is_heard(arrival_ns)) {
    note_silence();
    is_locked_ = false;
    if (protocol_.transport == LiveTransport::Udp) begin_connection();
  }
  if (!take_allowance(bytes.size(), arrival_ns)) {
    ++counters_.over_rate;
    return {};
  }
  const Result<LivePacket> packet = parser_->parse(bytes, arrival_ns);
  if (!packet) {
    ++counters_.malformed;
    note_malformed(sender, bytes, packet.error());
    return packet.error();
  }
  ++counters_.packets;
  counters_.received_bytes += bytes.size();
  if (!is_locked_ && (!packet->poses.empty() || packet->wind_mps)) hear(sender, arrival_ns);
  if (is_locked_) measure(arrival_ns);
  use(*packet, arrival_ns);
  for (const std::string& note : parser_->take_notes()) warn(note);
  return {};
}

/// With the protocol whose packet it is, where one reads a pose in it.
void LiveSource::note_malformed(const std::string& sender, std::span<const std::byte> bytes,
                                const Error& error) {
  constexpr uint64_t kMostTried = 8;  // of many that a sender may send
  std::string other;
  for (const LiveProtocol& protocol : live_protocols()) {
    if (counters_.malformed > kMostTried || protocol.transport == LiveTransport::Tcp) continue;
    LiveParserConfig config;
    config.protocol = protocol.name;
    const auto parser = make_live_parser(config);
    const auto packet = parser ? (*parser)->parse(bytes, 0) : parser.error();
    if (!other.empty() || !packet || packet->poses.empty()) continue;
    other = fmt::format("; it reads as a packet of {}, which wants --mocap {}", protocol.name, protocol.name);
  }
  if (notes_.size() < kMaxNotes)
    notes_.push_back({true,
                      fmt::format("{}: a malformed packet from {}: {}{}", describe(), sender,
                                  one_line(error.to_string(), kMaxNoteChars), other),
                      LiveNoteKind::Malformed});
}

/// Notes, once for a sender, that nine of ten poses of a second are not believed.
void LiveSource::note_unbelieved(int64_t now_ns) {
  if (offered_ == 0 || now_ns - offered_ns_ < kMotionStaleNs) return;
  const uint64_t offered = std::exchange(offered_, 0);
  const uint64_t refused = refused_poses() - refused_before_;
  if (refused * 10 < offered * 9 || std::exchange(has_told_unbelieved_, true)) return;
  const LivePolicyCounters& counters = policy_.counters();
  const char* const why =
      counters.impossible > counters.gated ? "they are no pose of a head" : "they jump as no head does";
  warn(fmt::format(
      "{} poses came from {} in {:.1f} s, and {} are not believed: {}, as with the bytes, axes or "
      "units of another protocol",
      offered, sender_, static_cast<double>(now_ns - offered_ns_) * kSPerNs, refused, why));
}

uint64_t LiveSource::refused_poses() const {
  return policy_.counters().impossible + policy_.counters().gated;
}

void LiveSource::warn(const std::string& text) {
  if (notes_.size() < kMaxNotes)
    notes_.push_back({true, fmt::format("{}: {}", describe(), text), LiveNoteKind::Found});
}

void LiveSource::hear(const std::string& sender, int64_t arrival_ns) {
  is_locked_ = true;
  was_heard_ = true;
  packet_ns_ = arrival_ns;
  window_begin_ns_ = arrival_ns;
  window_packets_ = 0;
  rate_hz_ = jitter_ms_ = interval_ms_ = 0.0;
  if (sender != sender_) {
    subjects_.clear();
    subject_.reset();
    policy_.begin_another();
    has_told_impossible_ = has_told_namesakes_ = has_told_unbelieved_ = false;
    offered_ = 0;
  }
  sender_ = sender;
  notes_.push_back({false, fmt::format("{}: {} sends", describe(), sender)});
}

/// Measures how often and how evenly packets come.
void LiveSource::measure(int64_t arrival_ns) {
  const double interval_ms = static_cast<double>(arrival_ns - packet_ns_) * kMsPerNs;
  packet_ns_ = arrival_ns;
  ++window_packets_;
  if (window_packets_ > 1) {
    if (interval_ms_ == 0.0) interval_ms_ = interval_ms;
    jitter_ms_ += (std::abs(interval_ms - interval_ms_) - jitter_ms_) * kJitterShare;
    interval_ms_ += (interval_ms - interval_ms_) * kJitterShare;
  }
  const int64_t passed_ns = arrival_ns - window_begin_ns_;
  if (passed_ns < kRateWindowNs) return;
  rate_hz_ = static_cast<double>(window_packets_ - 1) / (static_cast<double>(passed_ns) * kSPerNs);
  window_begin_ns_ = arrival_ns;
  window_packets_ = 1;
}

// ---- subjects

/// A body that goes on under another name is the same subject, unless its name was asked for.
void LiveSource::rename_subject(const LivePose& pose, const std::string& name,
                                const std::vector<std::string>& names) {
  if (!pose.body || has_seen(name)) return;
  const auto found = std::find_if(subjects_.begin(), subjects_.end(), [&](const Subject& subject) {
    return subject.body == pose.body && subject.name != live_.subject &&
           std::find(names.begin(), names.end(), subject.name) == names.end();
  });
  if (found == subjects_.end()) return;
  if (notes_.size() < kMaxNotes)
    notes_.push_back({false,
                      fmt::format("{}: {} is called {} now", describe(), shown(found->name), shown(name)),
                      LiveNoteKind::Subject});
  if (subject_ == found->name) subject_ = name;
  found->name = name;
}

void LiveSource::note_subject(const std::string& name, int64_t arrival_ns) {
  const auto found = std::find_if(subjects_.begin(), subjects_.end(),
                                  [&](const Subject& subject) { return subject.name == name; });
  if (found != subjects_.end()) {
    found->seen_ns = arrival_ns;
    return;
  }
  if (subjects_.size() >= kMaxLiveSubjects) {
    std::erase_if(subjects_, [&](const Subject& s) { return arrival_ns - s.seen_ns > kMotionStaleNs; });
    if (subjects_.size() >= kMaxLiveSubjects) return;
  }
  subjects_.push_back({name, arrival_ns, std::nullopt});
  if (!name.empty() && notes_.size() < kMaxNotes)
    notes_.push_back({false, fmt::format("{}: sees {}", describe(), shown(name)), LiveNoteKind::Subject});
}

/// Chooses who drives the head.
void LiveSource::follow_subject(int64_t now_ns) {
  std::optional<std::string> wanted;
  if (!live_.subject.empty()) {
    if (has_seen(live_.subject)) wanted = live_.subject;
  } else {
    const auto lives = [&](const Subject& subject) { return now_ns - subject.seen_ns <= kMotionStaleNs; };
    const auto is_of = [&](const Subject& subject) { return subject_ && subject.name == *subject_; };
    auto chosen = std::find_if(subjects_.begin(), subjects_.end(),
                               [&](const Subject& s) { return lives(s) && is_head(s.name); });
    if (chosen == subjects_.end())
      chosen = std::find_if(subjects_.begin(), subjects_.end(),
                            [&](const Subject& s) { return lives(s) && is_of(s); });
    if (chosen == subjects_.end()) chosen = std::find_if(subjects_.begin(), subjects_.end(), lives);
    wanted = chosen != subjects_.end() ? std::optional(chosen->name) : subject_;
  }
  if (wanted == subject_) return;
  subject_ = wanted;
  policy_.begin_another();
  if (subject_ && subject_->empty() && subjects_.size() == 1) return;  // there is nobody else
  notes_.push_back({false,
                    subject_ ? fmt::format("{}: {} drives the head", describe(), shown(*subject_))
                             : fmt::format("{}: waits for {}", describe(), live_.subject),
                    LiveNoteKind::Subject});
}

void LiveSource::choose_subject(const std::string& subject) {
  live_.subject = subject;
}

bool LiveSource::has_seen(const std::string& subject) const {
  return std::any_of(subjects_.begin(), subjects_.end(), [&](const Subject& s) { return s.name == subject; });
}

void LiveSource::use(const LivePacket& packet, int64_t arrival_ns) {
  std::vector<std::string> names;
  for (const LivePose& pose : packet.poses) {
    names.push_back(printable(pose.subject, kMaxNameChars));
  }
  for (size_t i = 0; i < names.size(); ++i) {
    rename_subject(packet.poses[i], names[i], names);
    note_subject(names[i], arrival_ns);
    const auto subject = std::find_if(subjects_.begin(), subjects_.end(),
                                      [&](const Subject& s) { return s.name == names[i]; });
    if (subject != subjects_.end()) subject->body = packet.poses[i].body;
  }
  follow_subject(arrival_ns);
  const LivePose* taken = nullptr;
  for (size_t i = 0; i < names.size(); ++i) {
    const LivePose& pose = packet.poses[i];
    if (!subject_ || names[i] != *subject_ || (taken != nullptr && is_namesake(pose, *taken))) continue;
    move_head(pose, arrival_ns);
    taken = &pose;
  }
  if (packet.take) wish(*packet.take);
  if (packet.wind_mps) wind_.push_back({{{arrival_ns, glm::vec3(*packet.wind_mps)}}});
}

/// True for another body of the same name and moment; the first is used.
bool LiveSource::is_namesake(const LivePose& pose, const LivePose& taken) {
  const bool is_of_a_moment = pose.frame || pose.source_time_ns;
  if (!is_of_a_moment || pose.frame != taken.frame || pose.source_time_ns != taken.source_time_ns ||
      pose.world_from_subject == taken.world_from_subject)
    return false;
  if (!std::exchange(has_told_namesakes_, true))
    warn(fmt::format("two subjects are called {}: the first of them is used", shown(*subject_)));
  return true;
}

void LiveSource::move_head(const LivePose& pose, int64_t arrival_ns) {
  const uint64_t impossible = policy_.counters().impossible;
  const uint64_t refused = refused_poses();
  if (offered_++ == 0) {
    offered_ns_ = arrival_ns;
    refused_before_ = refused;
  }
  policy_.take(scaled(pose, live_.scale), arrival_ns);
  if (refused_poses() > refused) refused_ns_ = arrival_ns;
  if (policy_.counters().impossible == impossible || std::exchange(has_told_impossible_, true)) return;
  warn(fmt::format("{} sends what is no head's pose, and is left out: {}", sender_,
                   one_line(fmt::format("{}", fmt::join(parser_->describe(), ", ")), kMaxNoteChars)));
}

// ---- what comes of it

LiveSource::Due LiveSource::advance(int64_t now_ns) {
  Due due;
  for (LiveHead& head : policy_.advance(now_ns)) {
    MotionSamples samples;
    samples.samples.push_back({head.time_ns, head.world_from_head, std::move(head.joint_m)});
    samples.joint_names = std::move(head.joint_names);
    samples.timecode = head.timecode;
    due.motion.push_back(std::move(samples));
  }
  note_unbelieved(now_ns);
  for (const std::string& note : policy_.take_notes()) warn(note);
  due.wind = std::exchange(wind_, {});
  if (!recordings_.empty() && now_ns - recorded_ns_ >= kRecordPauseNs) {
    due.recording = std::move(recordings_.front());
    recordings_.erase(recordings_.begin());
    recorded_ns_ = now_ns;
  }
  const bool is_stale_now = policy_.is_stale(now_ns);
  if (is_stale_now && !was_stale_) {
    due.has_ended = true;
    if (subject_ && is_heard(now_ns) && now_ns - refused_ns_ > kMotionStaleNs)
      notes_.push_back({true,
                        fmt::format("{}: nothing of {} for {:g} s: the head rests", describe(),
                                    shown(*subject_), static_cast<double>(kMotionStaleNs) * kSPerNs),
                        LiveNoteKind::Subject});
    if (live_.subject.empty()) follow_subject(now_ns);
  }
  was_stale_ = is_stale_now;
  if (!is_heard(now_ns)) note_silence();
  return due;
}

/// Notes, once after each time that a sender was heard, that it has stopped.
void LiveSource::note_silence() {
  if (!std::exchange(was_heard_, false)) return;
  rate_hz_ = 0.0;
  notes_.push_back({true, fmt::format("{}: {} has stopped sending: the head rests", describe(), sender_)});
}

LiveInputStatus LiveSource::status(int64_t now_ns) const {
  LiveInputStatus status;
  status.input = describe();
  if (is_heard(now_ns)) status.sender = sender_;
  if (subject_) status.subject = shown(*subject_);
  for (const Subject& subject : subjects_)
    if (now_ns - subject.seen_ns <= kMotionStaleNs)
      status.subjects += (status.subjects.empty() ? "" : ", ") + shown(subject.name);
  status.is_stale = policy_.is_stale(now_ns);
  status.is_calibrated = policy_.is_calibrated();
  status.rate_hz = rate_hz_;
  status.jitter_ms = jitter_ms_;
  status.age_ms =
      packet_ns_ == 0 ? 0.0 : static_cast<double>(std::max<int64_t>(now_ns - packet_ns_, 0)) * kMsPerNs;
  status.packets = counters_.packets;
  status.received_bytes = counters_.received_bytes;
  status.malformed = counters_.malformed;
  status.refused = counters_.refused;
  status.over_rate = counters_.over_rate;
  const LivePolicyCounters& policy = policy_.counters();
  status.impossible = policy.impossible;
  status.clamped = policy.clamped;
  status.gated = policy.gated;
  status.resequenced = policy.resequenced;
  status.late = policy.late;
  status.lost = policy.lost;
  const std::vector<std::string> lines = parser_->describe();
  for (const std::string& line : lines) {
    if (status.values.size() + 1 == kMaxLiveValues && lines.size() > kMaxLiveValues) {
      status.values.push_back({fmt::format("and {} more", lines.size() - status.values.size())});
      break;
    }
    status.values.push_back({one_line(line, kMaxLiveValueChars)});
  }
  return status;
}

}  // namespace strandcast
