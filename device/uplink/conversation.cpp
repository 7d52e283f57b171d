// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/conversation.h"

#include "common/wire/link_socket.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <variant>
#include <zmq.hpp>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds longest_poll{500};
constexpr int messages_between_polls = 32;

Ending refused(const std::string& text) {
  return {Ending::Kind::refused, text};
}

}  // namespace

// What each message of the host leads to; an error ends the conversation.
struct Conversation::Handler {
  Conversation& it;

  Result<void> operator()(const wire::Welcome& m) const { return it.on_welcome(m); }
  Result<void> operator()(const wire::Credit& m) const {
    it.upload_.on(m, Clock::now());
    return {};
  }
  Result<void> operator()(const wire::ScanState& m) const {
    const Result<void> done = it.upload_.on(m, Clock::now());
    it.events_.scan_refused(m.scan, m.phase == wire::ScanPhase::refused ? m.text : "");
    it.events_.changed();
    return done;
  }
  Result<void> operator()(const wire::FileAck& m) const {
    ++it.counts_.acknowledged_files;
    const Result<void> done = it.upload_.on(m);
    it.events_.changed();
    return done;
  }
  Result<void> operator()(const wire::FileResume& m) const {
    ++it.counts_.resumed_files;
    return it.upload_.on(m);
  }
  Result<void> operator()(const wire::StageProgress& m) const {
    it.events_.progress(m);
    return {};
  }
  Result<void> operator()(const wire::ResultOffer& m) const { return it.on_offer(m); }
  Result<void> operator()(const wire::ResultChunk& m) const { return it.on_chunk(m); }
  template <class Other>
  Result<void> operator()(const Other& /*Pong, or nothing a host should say*/) const {
    return {};
  }
};

Conversation::Conversation(zmq::context_t& context, const UplinkOptions& options, Spool& spool, Notices& notices,
                           UplinkCounts& counts, ConversationEvents events)
    : options_(options),
      spool_(spool),
      notices_(notices),
      counts_(counts),
      events_(std::move(events)),
      socket_(std::make_unique<zmq::socket_t>(context, zmq::socket_type::dealer)),
      upload_(spool, options.limit_bytes_per_s, options.refused_retry),
      ping_interval_(options.ping_interval) {
  configure_device_socket(*socket_, options.keys, options.host_public_key);
  monitor_ = std::make_unique<ConnectionMonitor>(context, *socket_);
}

Ending Conversation::hold(Wakeup& wakeup, const std::atomic<bool>& stop) {
  started_ = last_heard_ = last_sent_ = last_ping_ = Clock::now();
  try {
    socket_->connect(options_.host);
    const auto deadline = static_cast<std::uint32_t>(options_.silence_timeout.count());
    if (Result<void> sent =
            send(wire::Hello{wire::protocol_major, wire::protocol_minor, options_.device_name, {}, deadline});
        !sent) {
      return unreachable(sent.error().message());
    }
    return converse(wakeup, stop);
  } catch (const zmq::error_t& error) {
    return unreachable(error.what());
  }
}

Ending Conversation::converse(Wakeup& wakeup, const std::atomic<bool>& stop) {
  while (!stop) {
    std::array<zmq::pollitem_t, 3> items = {{{socket_->handle(), 0, ZMQ_POLLIN, 0},
                                             {monitor_->events().handle(), 0, ZMQ_POLLIN, 0},
                                             {nullptr, wakeup.descriptor(), ZMQ_POLLIN, 0}}};
    auto patience = more_to_write_ ? std::chrono::milliseconds(0) : std::min(longest_poll, ping_interval_);
    if (const auto limited = upload_.wait(Clock::now()); limited.count() > 0) patience = std::min(patience, limited);
    zmq::poll(items.data(), items.size(), patience);
    if (items[2].revents != 0) {
      wakeup.clear();
      upload_.refresh();
    }
    if (std::optional<Ending> ending = exchange()) return *ending;
  }
  return {Ending::Kind::stopped, ""};
}

std::optional<Ending> Conversation::exchange() {
  // Messages first: the host's reason for hanging up arrives before the event that it did.
  if (std::optional<Ending> ending = read_messages()) return ending;
  if (std::optional<Ending> ending = read_events()) return ending;
  if (std::optional<Ending> ending = write_messages()) return ending;
  return check_time();
}

std::optional<Ending> Conversation::read_events() {
  while (const std::optional<ConnectionEvent> event = monitor_->next()) {
    switch (*event) {
      case ConnectionEvent::connected:
        break;
      case ConnectionEvent::secured:
        secured_ = true;
        break;
      case ConnectionEvent::unknown_key:
        return refused("the host does not know this device: pair it; this device's key is " + options_.keys.public_key);
      case ConnectionEvent::lost:
        return unreachable(secured_ ? "the connection was lost"
                                    : "nobody answers there, or its key is not the one this device was paired with");
    }
  }
  return std::nullopt;
}

std::optional<Ending> Conversation::read_messages() {
  zmq::message_t body;
  for (int i = 0; i < messages_between_polls && socket_->recv(body, zmq::recv_flags::dontwait); ++i) {
    last_heard_ = Clock::now();
    Result<wire::Message> message = wire::decode(body.to_string_view());
    if (!message) return refused("the host does not speak our protocol: " + message.error().message());
    if (const auto* no = std::get_if<wire::Refused>(&*message)) {
      return no->permanent ? refused("the host refuses: " + no->reason) : Ending{Ending::Kind::again, no->reason};
    }
    const Result<void> done = std::visit(Handler{*this}, *message);
    if (!done) return refused(done.error().message());
  }
  return std::nullopt;
}

std::optional<Ending> Conversation::write_messages() {
  more_to_write_ = false;
  for (int i = 0; greeted_ && i < messages_between_polls; ++i) {
    Result<std::optional<wire::Message>> message = next_message();
    if (!message) return refused(message.error().message());
    if (!*message) return std::nullopt;
    if (Result<void> sent = send(std::move(**message)); !sent) return unreachable(sent.error().message());
  }
  more_to_write_ = greeted_;
  return std::nullopt;
}

// What is small goes before what is large.
Result<std::optional<wire::Message>> Conversation::next_message() {
  const Clock::time_point now = Clock::now();
  if (std::optional<wire::Message> notice = notices_.next(now)) return notice;
  Result<std::optional<wire::Message>> message = upload_.next(now);
  if (message && *message) {
    if (const auto* chunk = std::get_if<wire::FileChunk>(&**message)) counts_.bytes += chunk->data.size();
  }
  return message;
}

Result<void> Conversation::on_welcome(const wire::Welcome& welcome) {
  if (welcome.major != wire::protocol_major) {
    return fail("the host speaks protocol " + std::to_string(welcome.major) + ", this device " +
                    std::to_string(wire::protocol_major),
                options_.host, "bring both to the same version of Gyre");
  }
  greeted_ = true;
  // Three questions in the time the host waits, so that one that is lost on a bad line does not end the conversation.
  constexpr int questions = 3;
  const std::chrono::milliseconds often(welcome.deadline_ms / questions);
  if (often.count() > 0) ping_interval_ = std::min(ping_interval_, often);
  notices_.restart(welcome.capabilities);
  ++counts_.connections;
  spdlog::info("connected to {}", options_.host);
  events_.connected();
  return {};
}

std::optional<Ending> Conversation::check_time() {
  const Clock::time_point now = Clock::now();
  if (!greeted_) {
    if (now - started_ < options_.hello_timeout) return std::nullopt;
    return unreachable(secured_ ? "the host does not answer" : "no connection in time");
  }
  if (now - last_heard_ > options_.silence_timeout) return unreachable("the host has gone silent");
  // Also when the host talks without being asked: it has to hear that this device is there.
  if (now - std::max(std::min(last_heard_, last_sent_), last_ping_) < ping_interval_) return std::nullopt;
  last_ping_ = now;
  if (Result<void> sent = send(wire::Ping{}); !sent) return unreachable(sent.error().message());
  return std::nullopt;
}

Result<void> Conversation::on_offer(const wire::ResultOffer& offer) {
  const std::optional<SpoolPhase> phase = spool_.phase(offer.scan);
  if (!phase || *phase == SpoolPhase::recording || *phase == SpoolPhase::delivered) return {};
  if (Result<void> done = spool_.acknowledge_scan(offer.scan); !done) return done;
  downloads_.remove_if([&](const Download& download) { return download.scan() == offer.scan; });
  Download& download = downloads_.emplace_back(spool_, offer);
  const Result<void> started = download.start([this](wire::Message message) { return send(std::move(message)); });
  events_.changed();
  return started;
}

Result<void> Conversation::on_chunk(const wire::ResultChunk& chunk) {
  counts_.result_bytes += chunk.data.size();
  const auto download = std::find_if(downloads_.begin(), downloads_.end(),
                                     [&](const Download& candidate) { return candidate.scan() == chunk.scan; });
  if (download == downloads_.end()) return {};
  Result<void> done = download->on(chunk, [this](wire::Message message) { return send(std::move(message)); });
  if (!done || !download->finished()) return done;
  downloads_.erase(download);
  events_.changed();
  return {};
}

Result<void> Conversation::send(wire::Message message) {
  // Credit bounds what waits here, so a full queue means that the connection is as good as dead.
  if (socket_->send(message_of(wire::encode(std::move(message))), zmq::send_flags::dontwait)) {
    last_sent_ = Clock::now();
    return {};
  }
  return fail("the connection does not move", options_.host);
}

Ending Conversation::unreachable(const std::string& why) const {
  return {Ending::Kind::unreachable, "host " + options_.host + " is not reachable: " + why};
}

}  // namespace gyre
