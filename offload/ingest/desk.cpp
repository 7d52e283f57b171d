// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/desk.h"

#include "common/bundle/bundle.h"
#include "common/bundle/disk_space.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <variant>

namespace gyre {

namespace {

// Bytes [offset, offset + chunk) of a file, fewer at its end.
Result<std::string> read_chunk(const std::filesystem::path& file, std::uint64_t offset) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(offset));
  std::string data(wire::max_chunk_bytes, '\0');
  in.read(data.data(), static_cast<std::streamsize>(data.size()));
  if (in.bad() || (in.fail() && !in.eof())) return fail("cannot read a result", file.string());
  data.resize(static_cast<std::size_t>(in.gcount()));
  return data;
}

constexpr const char* shut_out = "this device was shut out; pair it again";

wire::ScanState refusal(const std::string& scan_id, const std::string& reason) {
  return {scan_id, wire::ScanPhase::refused, reason, {}};
}

// The scan a message is about, for those that need it opened first.
template <class Message>
const std::string* scan_of(const Message& message) {
  constexpr bool is_free = std::is_same_v<Message, wire::ScanOpen> || std::is_same_v<Message, wire::DeviceStatus> ||
                           std::is_same_v<Message, wire::CoveragePreview>;
  if constexpr (requires { message.scan; } && !is_free) return &message.scan;
  return nullptr;
}

}  // namespace

// What each message of a greeted device leads to. Messages only a host sends are a breach of the rules.
struct Desk::Handler {
  Desk& desk;
  const std::string& peer;
  Conversation& device;

  void operator()(const wire::Unknown&) const {}
  void operator()(const wire::Ping&) const { desk.send(peer, wire::Pong{}); }
  void operator()(const wire::ScanOpen& m) const { desk.open_scan(peer, device, m); }
  void operator()(const wire::FileChunk& m) const { desk.take_chunk(peer, device, m); }
  void operator()(const wire::Discard& m) const {
    if (Result<void> done = desk.receiver_.discard(m); !done) desk.give_up(peer, done.error());
  }
  void operator()(const wire::ScanClose& m) const { desk.close_scan(peer, m); }
  void operator()(const wire::ResultRequest& m) const { desk.send_result(peer, m); }
  void operator()(const wire::ResultAck& m) const {
    // An acknowledgement of results that are being made anew is late, not wrong.
    if (Result<void> done = desk.store_.set_delivered(m.scan); !done) return spdlog::info("{}", done.error().message());
    spdlog::info("scan {} delivered to {}", m.scan, device.device_name);
  }
  void operator()(const wire::DeviceStatus& m) const { desk.board_.told(device.key, m); }
  void operator()(const wire::CoveragePreview& m) const {
    // It overtakes the opening of its scan, and is then too early by a moment; or speaks of what is not the device's.
    if (device.scans.contains(m.scan)) desk.board_.told(device.key, m);
  }
  template <class Other>
  void operator()(const Other& /*not for a host*/) const {
    desk.refuse(peer, RefusalKind::not_allowed, "a device may not send this kind of message");
  }
};

Desk::Desk(DeskOptions options, Store& store, IsAllowed is_allowed, Send send,
           std::function<void(const std::string&)> on_queued, LinkBoard& board, std::function<void()> on_finished)
    : options_(options),
      store_(store),
      board_(board),
      receiver_(store, options.max_file_bytes, board.counts, std::move(on_finished)),
      is_allowed_(std::move(is_allowed)),
      send_(std::move(send)),
      on_queued_(std::move(on_queued)) {}

void Desk::receive(const std::string& peer, const std::string& key, std::string_view bytes) {
  handle(peer, key, bytes);
  remove_gone();
}

void Desk::handle(const std::string& peer, const std::string& key, std::string_view bytes) {
  if (key.empty()) return refuse(peer, RefusalKind::unknown_key, "not authenticated");
  // The doorman asks once a connection; a device that was shut out since keeps that connection.
  if (!is_allowed_(key)) {
    board_.shut_out(key);
    return refuse(peer, RefusalKind::shut_out, shut_out);
  }
  const Result<wire::Message> message = wire::decode(bytes);
  if (!message) return refuse(peer, RefusalKind::malformed, message.error().message());
  if (const auto* hello = std::get_if<wire::Hello>(&*message)) return greet(peer, key, *hello);
  const auto found = conversations_.find(peer);
  if (found == conversations_.end()) {
    return refuse(peer, RefusalKind::protocol, "this conversation has ended; start again", false);
  }
  Conversation& device = found->second;
  device.last_heard = std::chrono::steady_clock::now();
  const std::string* scan = std::visit([](const auto& m) { return scan_of(m); }, *message);
  if (scan && !device.scans.contains(*scan)) {
    return refuse(peer, RefusalKind::not_allowed, "scan " + *scan + " is not open here");
  }
  if (scan && !std::holds_alternative<wire::FileChunk>(*message)) settle_files(*scan);
  if (const auto* open = std::get_if<wire::ScanOpen>(&*message)) settle_files(open->scan);
  std::visit(Handler{*this, peer, device}, *message);
}

void Desk::answer_finished() {
  say_finished();
  remove_gone();
}

void Desk::say_finished() {
  for (Receiver::Finished& one : receiver_.finished()) {
    if (one.queued) on_queued_(one.scan);
    const std::string peer = peer_of(one.scan);
    if (peer.empty()) continue;  // it asks when it comes back
    if (one.answer) {
      send(peer, std::move(*one.answer));
    } else {
      give_up(peer, one.answer.error());
    }
  }
}

void Desk::settle_files(const std::string& scan_id) {
  receiver_.wait_for(scan_id);
  say_finished();
}

void Desk::settle(const std::string& scan_id) {
  settle_files(scan_id);
  receiver_.wait_for_checks();
  say_finished();
}

void Desk::greet(const std::string& peer, const std::string& key, const wire::Hello& hello) {
  if (hello.major != wire::protocol_major) {
    return refuse(peer, RefusalKind::protocol,
                  "this host speaks protocol " + std::to_string(wire::protocol_major) + ", the device " +
                      std::to_string(hello.major) + "; bring both to the same version of Gyre");
  }
  if (const auto before = peers_.find(key); before != peers_.end()) conversations_.erase(before->second);
  peers_[key] = peer;
  const std::chrono::milliseconds asked(hello.deadline_ms);
  const std::chrono::milliseconds deadline =
      asked.count() > 0 ? std::min(asked, options_.silence_timeout) : options_.silence_timeout;
  conversations_[peer] = {key, hello.device_name, 0, {}, std::chrono::steady_clock::now(), deadline};
  board_.arrived(key, hello);
  spdlog::info("device {} is connected", hello.device_name);
  send(peer, wire::Welcome{wire::protocol_major,
                           wire::protocol_minor,
                           {std::string(wire::takes_status), std::string(wire::takes_coverage)},
                           static_cast<std::uint32_t>(options_.silence_timeout.count())});
  send(peer, wire::Credit{options_.credit_bytes});
}

void Desk::open_scan(const std::string& peer, Conversation& device, const wire::ScanOpen& open) {
  Result<Scan> scan = scan_from_json(nlohmann::json::parse(open.description, nullptr, false));
  if (!scan || scan->id != open.scan) return send(peer, refusal(open.scan, "its scan.json is not usable"));
  const Result<std::optional<StoredScan>> known = store_.scan(open.scan);
  if (!known) return give_up(peer, known.error());
  if (*known && (*known)->device_key != device.key) {
    board_.counts.refused(RefusalKind::not_allowed);
    spdlog::warn("device {} asked for scan {}, which belongs to another device", device.device_name, open.scan);
    return send(peer, refusal(open.scan, "the scan belongs to another device"));
  }
  if (!*known) {
    const Result<std::optional<std::string>> reason = no_place_for(open);
    if (!reason) return give_up(peer, reason.error());
    if (*reason) {
      spdlog::warn("scan {} of device {} is not taken: {}", open.scan, device.device_name, **reason);
      return send(peer, refusal(open.scan, **reason));
    }
  }
  if (Result<void> opened = store_.open_scan(*scan, device.key, device.device_name); !opened) {
    return give_up(peer, opened.error());
  }
  Result<wire::ScanState> state = receiver_.state(open.scan);
  if (!state) return give_up(peer, state.error());
  device.scans.insert(open.scan);
  const wire::ScanPhase phase = state->phase;
  send(peer, std::move(*state));
  if (phase == wire::ScanPhase::done) return send_end(peer, open.scan);
  const auto latest = progress_.find(open.scan);
  if (latest != progress_.end()) send(peer, latest->second);
}

// Why the host does not begin with a scan it does not know, if it does not.
Result<std::optional<std::string>> Desk::no_place_for(const wire::ScanOpen& open) const {
  using Reason = std::optional<std::string>;
  const Result<std::optional<std::string>> deleted = store_.deleted_at(open.scan);
  if (!deleted) return tl::unexpected(deleted.error());
  if (*deleted) return Reason("it was deleted here on " + **deleted);
  const Result<std::uint64_t> left = free_bytes(store_.folder());
  if (!left) return tl::unexpected(left.error());
  if (*left >= options_.reserve_bytes) return Reason();
  constexpr std::uint64_t mib = 1 << 20;
  return Reason("the host's disk is nearly full (" + std::to_string(*left / mib) + " MiB left, " +
                std::to_string(options_.reserve_bytes / mib) + " MiB are kept free); free some space there");
}

void Desk::take_chunk(const std::string& peer, Conversation& device, const wire::FileChunk& chunk) {
  if (!wire::is_bundle_file(chunk.file.name)) {
    return refuse(peer, RefusalKind::not_allowed, "not a file of a scan: " + chunk.file.name);
  }
  Result<std::optional<wire::Message>> answer = receiver_.accept(chunk);
  if (!answer) return give_up(peer, answer.error());
  device.spent += wire::cost_of(chunk.data.size());
  // For every large chunk, because the device paces itself by it; for small ones not one each.
  if (device.spent >= wire::max_chunk_bytes / 2) {
    send(peer, wire::Credit{std::exchange(device.spent, 0)});
  }
  if (*answer) send(peer, std::move(**answer));
}

void Desk::close_scan(const std::string& peer, const wire::ScanClose& close) {
  Result<std::optional<wire::ScanState>> state = receiver_.close(close);
  if (!state) return give_up(peer, state.error());
  if (*state) return send(peer, std::move(**state));
  spdlog::info("scan {} is complete: {} files", close.scan, close.files.size());
}

void Desk::send_result(const std::string& peer, const wire::ResultRequest& request) {
  const Result<std::vector<StoredFile>> results = store_.results(request.scan);
  if (!results) return give_up(peer, results.error());
  const auto file = std::find_if(results->begin(), results->end(), [&](const StoredFile& f) {
    return f.name == request.name && f.sha256 == request.sha256;
  });
  // The scan was reconstructed again while the device fetched the results of the last time.
  if (file == results->end()) return send_end(peer, request.scan);
  Result<std::string> data = read_chunk(store_.bundle(request.scan).root() / request.name, request.offset);
  if (!data) return give_up(peer, data.error());
  board_.counts.sent_bytes += data->size();
  send(peer, wire::ResultChunk{request.scan, request.name, request.sha256, request.offset, std::move(*data)});
}

void Desk::send_end(const std::string& peer, const std::string& scan_id) {
  Result<wire::ScanState> state = receiver_.state(scan_id);
  if (!state) return give_up(peer, state.error());
  if (state->phase != wire::ScanPhase::done) return send(peer, std::move(*state));
  const Result<std::vector<StoredFile>> results = store_.results(scan_id);
  if (!results) return give_up(peer, results.error());
  wire::ResultOffer offer{scan_id, {}};
  for (const StoredFile& file : *results) offer.files.push_back({file.name, file.size, file.sha256});
  send(peer, std::move(offer));
}

void Desk::publish(const wire::StageProgress& progress) {
  progress_[progress.scan] = progress;
  const std::string peer = peer_of(progress.scan);
  if (!peer.empty()) send(peer, progress);
  remove_gone();
}

void Desk::publish_end(const std::string& scan_id) {
  progress_.erase(scan_id);
  const std::string peer = peer_of(scan_id);
  if (!peer.empty()) send_end(peer, scan_id);
  remove_gone();
}

void Desk::forget_gone() {
  receiver_.tidy();
  const auto now = std::chrono::steady_clock::now();
  for (const auto& [peer, device] : conversations_) {
    if (now - device.last_heard > device.deadline) {
      spdlog::info("device {} has gone silent", device.device_name);
      gone_.insert(peer);
    } else if (!is_allowed_(device.key)) {
      board_.shut_out(device.key);
      refuse(peer, RefusalKind::shut_out, shut_out);
    }
  }
  remove_gone();
}

// The connection on which that scan's device has opened it, or empty.
std::string Desk::peer_of(const std::string& scan_id) const {
  for (const auto& [peer, device] : conversations_) {
    if (device.scans.contains(scan_id)) return peer;
  }
  return {};
}

void Desk::send(const std::string& peer, wire::Message message) {
  if (send_(peer, std::move(message))) return;
  // A device that left, or lets its answers pile up: it finds everything in the store when it comes back.
  const auto found = conversations_.find(peer);
  if (found != conversations_.end()) {
    ++board_.counts.dropped_messages;
    spdlog::debug("device {} has left", found->second.device_name);
  }
  gone_.insert(peer);
}

void Desk::refuse(const std::string& peer, RefusalKind kind, const std::string& reason, bool permanent) {
  const auto found = conversations_.find(peer);
  const std::string name = found == conversations_.end() ? "an unknown device" : "device " + found->second.device_name;
  board_.counts.refused(kind);
  spdlog::log(permanent ? spdlog::level::warn : spdlog::level::debug, "refused {}: {}", name, reason);
  send(peer, wire::Refused{reason, permanent});
  gone_.insert(peer);
}

void Desk::give_up(const std::string& peer, const Error& error) {
  board_.counts.refused(RefusalKind::host_fault);
  spdlog::error("{}", error.message());
  send(peer, wire::Refused{"the host cannot go on: " + error.message(), true});
  gone_.insert(peer);
}

void Desk::remove_gone() {
  for (const std::string& peer : gone_) {
    const auto found = conversations_.find(peer);
    if (found == conversations_.end()) continue;
    const auto current = peers_.find(found->second.key);
    if (current != peers_.end() && current->second == peer) {
      peers_.erase(current);
      board_.left(found->second.key);
    }
    conversations_.erase(found);
  }
  gone_.clear();
}

}  // namespace gyre
