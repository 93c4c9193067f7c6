// Joins a Strandcast server and prints where the tip of the first strand is, state by state.
//   join [HOST [PORT [STATES]]]      a token, where one is needed, in the variable STRANDCAST_TOKEN
#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdlib>
#include <stdexcept>

#include "common/replay/strand_replay.h"
#include "common/strands/scene_asset.h"
#include "strandcast/v1/session.pb.h"

namespace asio = boost::asio;
namespace beast = boost::beast;
using namespace strandcast;

int main(int count, char** words) try {
  const std::string host = count > 1 ? words[1] : "127.0.0.1", port = count > 2 ? words[2] : "7878";
  asio::io_context io;
  beast::websocket::stream<asio::ip::tcp::socket> server(io);
  asio::connect(server.next_layer(), asio::ip::tcp::resolver(io).resolve(host, port));
  server.set_option(beast::websocket::stream_base::decorator([](beast::websocket::request_type& request) {
    request.set(beast::http::field::sec_websocket_protocol, "strandcast.v1");
  }));
  server.binary(true);
  server.read_message_max(kFrameHeaderBytes + kMaxMediaPayloadBytes);
  server.handshake(host + ":" + port, "/v1");

  const auto send = [&](const v1::ClientMessage& message) {
    server.write(asio::buffer(static_cast<char>(Opcode::Control) + message.SerializeAsString()));
  };
  const auto ask_for_keyframe = [&] {
    v1::ClientMessage message;
    message.mutable_keyframe_request();
    send(message);
  };
  v1::ClientMessage hello;  // a viewer of strands, as nothing else is said
  hello.mutable_hello()->set_name("join");
  if (const char* token = std::getenv("STRANDCAST_TOKEN")) hello.mutable_hello()->set_token(token);
  send(hello);

  std::unique_ptr<StrandReplay> replay;  // from the Welcome on
  for (long left = count > 3 ? std::atol(words[3]) : 10; left > 0;) {
    beast::flat_buffer buffer;
    server.read(buffer);
    const std::span message(static_cast<const std::byte*>(buffer.data().data()), buffer.size());
    if (message.empty()) continue;
    const auto opcode = static_cast<Opcode>(message.front());
    v1::ServerMessage told;
    if (opcode == Opcode::Control &&
        told.ParseFromArray(message.data() + 1, static_cast<int>(message.size()) - 1)) {
      if (told.has_goodbye()) throw std::runtime_error(told.goodbye().reason());
      if (!told.has_welcome()) continue;
      const StrandStreamLimits limits{told.welcome().strand_count(), told.welcome().vertex_count()};
      auto made = StrandReplay::make(told.welcome().codec(), limits, ask_for_keyframe);
      if (!made) throw std::runtime_error(made.error().to_string());
      replay = std::move(made).value();
    } else if (opcode == Opcode::Asset && replay != nullptr) {
      if (const auto asset = decode_scene_asset(message.subspan(kFrameHeaderBytes)))
        replay->set_rest_shape(asset->rest_position_m);
    } else if ((opcode == Opcode::StrandKeyframe || opcode == Opcode::StrandDelta) && replay != nullptr) {
      const auto state = replay->receive(message, now_ns(), ClockOffset());
      if (state == nullptr) continue;  // of no use: counted, and a keyframe is asked for
      const std::vector<glm::vec3> in_head = positions_in_head(*state);
      const glm::dvec3 tip =
          state->world_from_head * glm::dvec3(in_head[in_head.size() - state->strand_count]);
      fmt::print("tick {}: tip of strand 0 at {:.4f} {:.4f} {:.4f} m, state {:016x}\n", state->tick, tip.x,
                 tip.y, tip.z, state_hash(*state));
      --left;
    }
  }
  return 0;
} catch (const beast::system_error& error) {
  fmt::print(stderr, "join: {}\n", error.code().message());
  return 1;
} catch (const std::exception& error) {
  fmt::print(stderr, "join: {}\n", error.what());
  return 1;
}
