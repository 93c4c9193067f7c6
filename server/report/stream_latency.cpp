#include "server/report/stream_latency.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/strands/strand_codec.h"

namespace strandcast {
namespace {

class Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  Socket& operator=(Socket&&) = delete;
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Two ends of a TCP connection on loopback.
struct Loopback {
  Socket sender;
  Socket receiver;
};

Result<Loopback> connect_loopback() {
  const auto failed = [] { return make_error(ErrorCode::Unavailable, "no TCP connection on loopback"); };
  const Socket listener(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener.get(), generic, size) != 0 || listen(listener.get(), 1) != 0 ||
      getsockname(listener.get(), generic, &size) != 0)
    return failed();
  Socket sender(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (connect(sender.get(), generic, size) != 0) return failed();
  Socket receiver(accept(listener.get(), nullptr, nullptr));
  constexpr int kOn = 1;
  if (receiver.get() < 0 || setsockopt(sender.get(), IPPROTO_TCP, TCP_NODELAY, &kOn, sizeof(kOn)) != 0)
    return failed();
  return Loopback{std::move(sender), std::move(receiver)};
}

bool send_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(sent));
  }
  return true;
}

bool receive_all(int descriptor, std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t received = recv(descriptor, bytes.data(), bytes.size(), 0);
    if (received <= 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(received));
  }
  return true;
}

/// The message through the kernel, sent and received by two threads as by server and viewer.
Result<std::vector<std::byte>> transfer(const Loopback& loopback, std::span<const std::byte> message) {
  std::vector<std::byte> received(message.size());
  bool is_sent = false;
  {
    const std::jthread sender([&] { is_sent = send_all(loopback.sender.get(), message); });
    if (!receive_all(loopback.receiver.get(), received))
      return make_error(ErrorCode::Unavailable, "the connection on loopback broke");
  }
  if (!is_sent) return make_error(ErrorCode::Unavailable, "the connection on loopback broke");
  return received;
}

class StageList {
 public:
  void add(const std::string& name, double ms) {
    const auto found =
        std::find_if(stages_.begin(), stages_.end(), [&](const auto& stage) { return stage.first == name; });
    StageTimer& timer =
        found == stages_.end() ? stages_.emplace_back(name, StageTimer()).second : found->second;
    timer.add_ms(ms);
    frame_ms_ += ms;
  }
  void end_frame() {
    total_.add_ms(frame_ms_);
    frame_ms_ = 0.0;
  }
  std::vector<LatencyStage> stages() const {
    std::vector<LatencyStage> result;
    for (const auto& [name, timer] : stages_) result.push_back(summary(name, timer));
    return result;
  }
  LatencyStage total() const { return summary("all of these", total_); }

 private:
  static LatencyStage summary(const std::string& name, const StageTimer& timer) {
    constexpr double kP99 = 0.99;
    return {name, timer.median_ms(), timer.quantile_ms(kP99)};
  }
  std::vector<std::pair<std::string, StageTimer>> stages_;
  StageTimer total_;
  double frame_ms_ = 0.0;
};

}  // namespace

Result<StreamLatency> measure_latency(const StreamRecording& recording, const std::string& codec,
                                      double bound_m) {
  const StreamShape& shape = recording.shape;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(codec, static_cast<float>(bound_m)));
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder(codec));
  ASSIGN_OR_RETURN(const auto decoder, make_strand_decoder(codec, {shape.strand_count, shape.vertex_count}));
  encoder->set_rest_shape(shape.rest_in_head_m);
  decoder->set_rest_shape(shape.rest_in_head_m);
  ASSIGN_OR_RETURN(const Loopback loopback, connect_loopback());

  StageList stages;
  std::vector<double> sizes;
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    int64_t begin_ns = now_ns();
    const auto lap_ms = [&] {
      const int64_t end_ns = now_ns();
      return static_cast<double>(end_ns - std::exchange(begin_ns, end_ns)) * 1e-6;
    };
    const Snapshot snapshot = on_lattice(recording.frames[i], quantum_m);
    const double publish_ms = lap_ms();
    const EncodedFramePtr frame = encoder->encode(snapshot);
    if (!frame) return make_error(ErrorCode::LimitExceeded, "a frame is too large to send");
    const double encode_ms = lap_ms();
    ASSIGN_OR_RETURN(const std::vector<std::byte> received, transfer(loopback, frame->message));
    const double transfer_ms = lap_ms();
    if (const auto decoded = decoder->decode(received); !decoded) return decoded.error();
    const double decode_ms = lap_ms();
    if (i == 0) continue;  // the keyframe
    stages.add("simulate one step and read it back", recording.step_ms[i]);
    stages.add("publish: round to the lattice", publish_ms);
    stages.add("encode", encode_ms);
    stages.add("send and receive, TCP on loopback", transfer_ms);
    stages.add("decode", decode_ms);
    stages.end_frame();
    sizes.push_back(static_cast<double>(received.size()));
  }
  return StreamLatency{recording.motion_name,
                       {shape.strand_count, shape.vertex_count},
                       codec,
                       bound_m,
                       median(sizes),
                       stages.stages(),
                       stages.total()};
}

}  // namespace strandcast
