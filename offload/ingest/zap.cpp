// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/zap.h"

#include "common/keys/keys.h"

#include <spdlog/spdlog.h>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>
#include <zmq.hpp>
#include <zmq_addon.hpp>

namespace gyre {

namespace {

// Frames of a request, after the version: request id, domain, address, identity, mechanism, credentials.
constexpr std::size_t request_frames = 7;
constexpr std::string_view zap_version = "1.0";

std::string_view text_of(const zmq::message_t& frame) {
  return {static_cast<const char*>(frame.data()), frame.size()};
}

std::string z85_of(const zmq::message_t& key) {
  if (key.size() != 32) return {};
  std::array<char, 41> text{};
  zmq_z85_encode(text.data(), static_cast<const std::uint8_t*>(key.data()), key.size());
  return {text.data()};
}

}  // namespace

ZapHandler::ZapHandler(zmq::context_t& context, std::filesystem::path allow_list, LinkCounts& counts)
    : allow_list_(std::move(allow_list)), counts_(counts) {
  zmq::socket_t socket(context, zmq::socket_type::rep);
  socket.set(zmq::sockopt::linger, 0);
  socket.bind("inproc://zeromq.zap.01");
  thread_ = std::thread(&ZapHandler::serve, this, std::move(socket));
}

ZapHandler::~ZapHandler() {
  stop_.notify();
  thread_.join();
}

void ZapHandler::serve(zmq::socket_t socket) {
  while (true) {
    std::array<zmq::pollitem_t, 2> items = {
        {{socket.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, stop_.descriptor(), ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size());
    if (items[1].revents != 0) return;
    std::vector<zmq::message_t> request;
    static_cast<void>(zmq::recv_multipart(socket, std::back_inserter(request)));

    std::string key;
    std::optional<std::string> name;
    const bool curve = request.size() == request_frames && text_of(request[5]) == "CURVE";
    if (curve) {
      key = z85_of(request[6]);
      name = authorised_name(allow_list_, key);
    }
    if (name) {
      spdlog::debug("device {} connects from {}", *name, text_of(request[3]));
    } else {
      counts_.refused(RefusalKind::unknown_key);
      spdlog::warn("refused a device from {}: its key {} is not on the list; to let it in, authorise that key",
                   request.size() > 3 ? text_of(request[3]) : "?", key.empty() ? "(none)" : key);
    }
    std::array<zmq::const_buffer, 6> reply = {
        zmq::buffer(zap_version),
        request.size() > 1 ? zmq::const_buffer(request[1].data(), request[1].size()) : zmq::const_buffer(),
        zmq::buffer(std::string_view(name ? "200" : "400")),
        zmq::buffer(std::string_view(name ? "OK" : "unknown key")),
        zmq::buffer(key),
        zmq::const_buffer()};
    static_cast<void>(zmq::send_multipart(socket, reply));
  }
}

}  // namespace gyre
