// SPDX-License-Identifier: Apache-2.0
#include "tests/system/message_relay.h"

#include "common/wire/link_socket.h"
#include "device/uplink/monitor.h"

#include <array>

namespace gyre {

MessageRelay::MessageRelay(const KeyPair& host, const KeyPair& device, std::string host_endpoint, unsigned seed,
                           std::function<void()> on_lost)
    : host_(host),
      device_(device),
      host_endpoint_(std::move(host_endpoint)),
      random_(seed),
      on_lost_(std::move(on_lost)),
      front_(context_, zmq::socket_type::router) {
  configure_host_socket(front_, host_);
  front_.bind("tcp://127.0.0.1:*");
  const std::string endpoint = front_.get(zmq::sockopt::last_endpoint);
  port_ = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  thread_ = std::thread([this] { relay(); });
}

MessageRelay::~MessageRelay() {
  over_ = true;
  thread_.join();
  monitor_.reset();
}

void MessageRelay::connect_to_host() {
  monitor_.reset();
  back_ = std::make_unique<zmq::socket_t>(context_, zmq::socket_type::dealer);
  configure_device_socket(*back_, device_, host_.public_key);
  monitor_ = std::make_unique<ConnectionMonitor>(context_, *back_);
  back_->connect(host_endpoint_);
}

void MessageRelay::relay() {
  const Send up = [this](const std::string& bytes) { send_up(bytes); };
  const Send down = [this](const std::string& bytes) { send_down(bytes); };
  while (!over_) {
    constexpr std::chrono::milliseconds longest_kept{20};
    std::vector<zmq::pollitem_t> items = {{front_.handle(), 0, ZMQ_POLLIN, 0}};
    if (back_) {
      items.push_back({back_->handle(), 0, ZMQ_POLLIN, 0});
      items.push_back({monitor_->events().handle(), 0, ZMQ_POLLIN, 0});
    }
    if (zmq::poll(items.data(), items.size(), longest_kept) == 0) {
      release(up_, up);
      release(down_, down);
      continue;
    }
    if (back_ && items[1].revents != 0) from_host();
    bool lost = false;
    if (back_ && items[2].revents != 0) {
      while (const std::optional<ConnectionEvent> event = monitor_->next()) {
        lost = lost || *event == ConnectionEvent::lost || *event == ConnectionEvent::unknown_key;
      }
    }
    if (lost) {
      monitor_.reset();
      back_.reset();
      on_lost_();
    }
    if (items[0].revents != 0) from_device();
  }
  monitor_.reset();
  back_.reset();
}

void MessageRelay::from_device() {
  zmq::message_t peer;
  zmq::message_t body;
  if (!front_.recv(peer, zmq::recv_flags::dontwait) || !front_.recv(body)) return;
  if (peer.to_string() != peer_) {
    peer_ = peer.to_string();
    up_ = down_ = {};
    connect_to_host();
  }
  pass(up_, body.to_string(), [this](const std::string& bytes) { send_up(bytes); });
}

void MessageRelay::from_host() {
  zmq::message_t body;
  if (!back_->recv(body, zmq::recv_flags::dontwait)) return;
  pass(down_, body.to_string(), [this](const std::string& bytes) { send_down(bytes); });
}

bool MessageRelay::chance(std::atomic<int>& left) {
  if (left <= 0) return false;
  --left;
  return random_() % 2 == 0;
}

void MessageRelay::pass(Way& way, std::string bytes, const Send& send) {
  if (!way.kept_back && chance(reordering_)) {
    way.kept_back = std::move(bytes);
    return;
  }
  send(bytes);
  if (chance(doubling_)) send(bytes);
  release(way, send);
}

void MessageRelay::release(Way& way, const Send& send) {
  if (!way.kept_back) return;
  send(*way.kept_back);
  way.kept_back.reset();
}

void MessageRelay::send_up(const std::string& bytes) {
  if (back_) static_cast<void>(back_->send(zmq::buffer(bytes), zmq::send_flags::dontwait));
}

void MessageRelay::send_down(const std::string& bytes) {
  try {
    static_cast<void>(front_.send(zmq::buffer(peer_), zmq::send_flags::dontwait | zmq::send_flags::sndmore) &&
                      front_.send(zmq::buffer(bytes), zmq::send_flags::dontwait));
  } catch (const zmq::error_t&) {
    return;  // the device has left
  }
}

}  // namespace gyre
