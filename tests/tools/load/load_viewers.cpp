#include "tests/tools/load/load_viewers.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include "common/base/hash.h"
#include "common/base/profile.h"
#include "common/strands/frame_header.h"
#include "tests/tools/load/load_socket.h"
#include "tests/tools/load/web_socket_reader.h"

namespace strandcast::load {
namespace {

constexpr size_t kReadBytes = 256u << 10;
constexpr float kMsPerNs = 1e-6f;
constexpr int64_t kPingIntervalNs = 1'000'000'000;

struct Viewer {
  ViewerPlan plan;
  LoadSocket socket;
  WebSocketReader reader;
  std::vector<std::byte> unsent;
  bool has_welcome = false;
  bool is_over = false;
  uint16_t stream_id = 0;
  uint32_t sequence = 0;
  int64_t frame_ns = 0;        // arrival of the newest strand frame or picture
  int64_t first_frame_ns = 0;  // and of the first
  bool has_chain = false;

  void queue(const ClientMessage& message) { append_frame(unsent, WebSocketOpcode::Binary, encode(message)); }
};

}  // namespace

class LoadViewers::State {
 public:
  explicit State(const LoadConfig& config) : config_(config) {}

  Result<uint64_t> join(const ViewerPlan& plan) {
    if (config_.encryption && tls_ == nullptr) {
      ASSIGN_OR_RETURN(tls_, make_tls_settings(config_.encryption->authorities));
    }
    ASSIGN_OR_RETURN(LoadSocket socket, LoadSocket::connect(config_.host, config_.port, tls_));
    Viewer viewer{.plan = plan,
                  .socket = std::move(socket),
                  .reader = {},
                  .unsent = make_upgrade(config_.host, config_.port, config_.folder)};
    viewers_.emplace(++last_number_, std::move(viewer));
    return last_number_;
  }

  void leave(uint64_t number, bool is_rude) {
    const auto found = viewers_.find(number);
    if (found == viewers_.end()) return;
    if (is_rude) found->second.socket.be_rude();
    viewers_.erase(found);
  }

  void run_for(int64_t duration_ms) {
    const int64_t end_ns = now_ns() + duration_ms * 1'000'000;
    while (true) {
      const int64_t left_ms = (end_ns - now_ns()) / 1'000'000;
      if (left_ms < 0) return;
      turn(static_cast<int>(left_ms));
    }
  }

  std::map<uint64_t, Viewer> viewers_;
  LoadMeasures measures_;

 private:
  void turn(int wait_ms) {
    send_pings();
    std::vector<pollfd> waits;
    std::vector<uint64_t> numbers;
    for (const auto& [number, viewer] : viewers_) {
      const bool wants_read = viewer.plan.reads || !viewer.has_welcome;
      const bool wants_write = !viewer.unsent.empty() && !viewer.socket.needs_input_to_write();
      const int events = (wants_read ? POLLIN : 0) | (wants_write ? POLLOUT : 0);
      waits.push_back({events == 0 ? -1 : viewer.socket.descriptor(), static_cast<short>(events), 0});
      numbers.push_back(number);
    }
    if (poll(waits.data(), waits.size(), wait_ms) <= 0) return;
    for (size_t i = 0; i < waits.size(); ++i) {
      if (waits[i].revents == 0) continue;
      Viewer& viewer = viewers_.at(numbers[i]);
      if ((waits[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) read(viewer);
      if (!viewer.is_over) write(viewer);
      if (viewer.is_over) viewers_.erase(numbers[i]);
    }
  }

  /// As every client does: shows the server that somebody is there.
  void send_pings() {
    const int64_t time_ns = now_ns();
    if (time_ns - pinged_ns_ < kPingIntervalNs) return;
    pinged_ns_ = time_ns;
    for (auto& [number, viewer] : viewers_)
      if (viewer.has_welcome && viewer.plan.reads && viewer.plan.acknowledges) viewer.queue(Ping{time_ns});
  }

  void end(Viewer& viewer, uint16_t close_code) {
    if (std::exchange(viewer.is_over, true)) return;
    ++measures_.ended;
    ++measures_.close_codes[close_code];
  }

  void write(Viewer& viewer) {
    if (viewer.unsent.empty()) return;
    const ssize_t size = viewer.socket.send_some(viewer.unsent);
    if (size < 0) return end(viewer, 0);
    viewer.unsent.erase(viewer.unsent.begin(), viewer.unsent.begin() + size);
    if (viewer.unsent.size() > kMaxUnsentBytes) end(viewer, 0);
  }

  void read(Viewer& viewer) {
    do {
      const ssize_t size = viewer.socket.receive_some(buffer_);
      if (size == 0) return;
      if (size < 0) return end(viewer, 0);
      std::span<const std::byte> bytes = std::span(buffer_).first(static_cast<size_t>(size));
      while (!bytes.empty() && !viewer.is_over)
        if (const auto event = viewer.reader.take(bytes)) take_event(viewer, *event);
    } while (!viewer.is_over && viewer.socket.has_more());
  }

  void take_event(Viewer& viewer, const WebSocketReader::Event& event) {
    switch (event.what) {
      case WebSocketReader::What::Upgraded:
        return greet(viewer);
      case WebSocketReader::What::Refused:
        return end(viewer, 0);
      case WebSocketReader::What::Message:
        return take_message(viewer, event);
      case WebSocketReader::What::Ping:
        return append_frame(viewer.unsent, WebSocketOpcode::Pong, event.payload);
      case WebSocketReader::What::Close:
        append_frame(viewer.unsent, WebSocketOpcode::Close, event.payload);
        write(viewer);
        return end(viewer, event.payload.size() < 2
                               ? 0
                               : static_cast<uint16_t>(std::to_integer<unsigned>(event.payload[0]) << 8 |
                                                       std::to_integer<unsigned>(event.payload[1])));
    }
  }

  void greet(Viewer& viewer) {
    Hello hello;
    hello.mode = viewer.plan.mode;
    hello.name = "load";
    hello.token = config_.token;
    hello.acknowledges = viewer.plan.acknowledges;
    hello.step_ns = config_.step_ns;
    viewer.queue(hello);
  }

  void take_message(Viewer& viewer, const WebSocketReader::Event& event) {
    const std::vector<std::byte>& begin = event.payload;
    if (begin.empty()) return;
    if (static_cast<Opcode>(begin[0]) == Opcode::Control) return take_control(viewer, begin);
    if (begin.size() < kFrameHeaderBytes) return;
    FrameHeader header;
    const auto at = [&](size_t offset, auto& value) {
      std::memcpy(&value, begin.data() + offset, sizeof value);
    };
    header.opcode = static_cast<Opcode>(begin[0]);
    at(2, header.stream_id);
    at(4, header.sequence);
    at(8, header.base_sequence);
    at(24, header.send_time_ns);
    const int64_t time_ns = now_ns();
    if (viewer.plan.acknowledges) viewer.queue(FrameAck{header.sequence, time_ns, 0, header.stream_id});
    measures_.bytes += event.message_bytes;
    if (header.opcode == Opcode::Asset) return;
    take_media(viewer, header, time_ns);
  }

  void keep(std::vector<float>& values, float value) {
    if (values.size() < kMaxMeasuredValues) return values.push_back(value);
    values[mix_u32(++replaced_) % kMaxMeasuredValues] = value;
  }

  void take_media(Viewer& viewer, const FrameHeader& header, int64_t time_ns) {
    ++measures_.frames;
    const bool is_keyframe = header.opcode == Opcode::StrandKeyframe;
    measures_.keyframes += is_keyframe ? 1 : 0;
    if (header.opcode == Opcode::StrandDelta) {
      const bool continues =
          viewer.has_chain && header.stream_id == viewer.stream_id && header.base_sequence == viewer.sequence;
      measures_.chain_errors += continues ? 0 : 1;
    }
    viewer.has_chain = true;
    viewer.stream_id = header.stream_id;
    viewer.sequence = header.sequence;
    if (viewer.frame_ns != 0)
      keep(measures_.interval_ms, static_cast<float>(time_ns - viewer.frame_ns) * kMsPerNs);
    viewer.frame_ns = time_ns;
    if (viewer.first_frame_ns == 0) viewer.first_frame_ns = time_ns;
    if (!is_keyframe)
      keep(measures_.latency_ms, static_cast<float>(time_ns - header.send_time_ns) * kMsPerNs);
  }

  void take_control(Viewer& viewer, const std::vector<std::byte>& bytes) {
    const auto message = decode_server_message(bytes);
    if (!message) return;
    if (const auto* welcome = std::get_if<Welcome>(&*message)) {
      viewer.has_welcome = true;
      ++measures_.joined;
      if (welcome->mode == StreamMode::Strands) ++measures_.joined_by_codec[welcome->codec];
    }
    if (const auto* quality = std::get_if<StreamQuality>(&*message)) {
      ++measures_.quality_changes;
      measures_.newest_quality = *quality;
      measures_.newest_quality_ms =
          viewer.first_frame_ns == 0 ? 0.0f : static_cast<float>(now_ns() - viewer.first_frame_ns) * kMsPerNs;
    }
    if (const auto* goodbye = std::get_if<Goodbye>(&*message)) measures_.last_goodbye = goodbye->reason;
  }

  const LoadConfig config_;
  TlsSettings tls_;  // when the first viewer needs it
  uint64_t last_number_ = 0;
  int64_t pinged_ns_ = 0;
  uint32_t replaced_ = 0;  // measured values
  std::array<std::byte, kReadBytes> buffer_{};
};

LoadViewers::LoadViewers(const LoadConfig& config) : state_(std::make_unique<State>(config)) {}
LoadViewers::~LoadViewers() = default;

Result<uint64_t> LoadViewers::join(const ViewerPlan& plan) {
  return state_->join(plan);
}
void LoadViewers::leave(uint64_t viewer, bool is_rude) {
  state_->leave(viewer, is_rude);
}
uint64_t LoadViewers::oldest() const {
  return state_->viewers_.empty() ? 0 : state_->viewers_.begin()->first;
}
void LoadViewers::run_for(int64_t duration_ms) {
  state_->run_for(duration_ms);
}
size_t LoadViewers::open_count() const {
  return state_->viewers_.size();
}
size_t LoadViewers::watching_count() const {
  return static_cast<size_t>(std::count_if(state_->viewers_.begin(), state_->viewers_.end(),
                                           [](const auto& item) { return item.second.frame_ns != 0; }));
}
const LoadMeasures& LoadViewers::measures() const {
  return state_->measures_;
}
void LoadViewers::reset_measures() {
  LoadMeasures fresh;
  fresh.newest_quality = state_->measures_.newest_quality;
  fresh.newest_quality_ms = state_->measures_.newest_quality_ms;
  fresh.joined_by_codec = state_->measures_.joined_by_codec;
  state_->measures_ = std::move(fresh);
}

}  // namespace strandcast::load
