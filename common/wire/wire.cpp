// SPDX-License-Identifier: Apache-2.0
#include "common/wire/wire.h"

#include "common/bundle/bundle.h"
#include "common/bundle/ulid.h"
#include "common/keys/cpace.h"
#include "common/keys/keys.h"

#include <gyre.pb.h>
#include <algorithm>
#include <cmath>

namespace gyre::wire {

namespace {

// Length of the UTF-8 character `text` starts with, 0 when it is none that may be shown on one line.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7f ? 1 : 0;
  const std::size_t length = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  const bool overlong = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xf0 && byte(1) < 0x90);
  const bool outside = (byte(0) == 0xed && byte(1) >= 0xa0) || (byte(0) == 0xf4 && byte(1) >= 0x90);
  return overlong || outside ? 0 : length;
}

// Text from a peer ends up in logs and on pages: valid UTF-8 on one line, of bounded length.
std::string clean(std::string_view text, std::size_t limit = max_text_bytes) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const std::string_view character = length > 0 ? text.substr(0, length) : std::string_view("?");
    if (out.size() + character.size() > limit) break;
    out += character;
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

bool is_hash(std::string_view text) {
  return text.size() == 64 &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool is_file(std::string_view name) {
  return is_bundle_file(name) || is_result_file(name);
}

void put(pb::FileEntry& to, const FileEntry& from) {
  to.set_name(from.name);
  to.set_size(from.size);
  to.set_sha256(from.sha256);
}

FileEntry entry_of(const pb::FileEntry& from) {
  return {from.name(), from.size(), from.sha256()};
}

template <class Texts>
Capabilities capabilities_of(const Texts& texts) {
  Capabilities capabilities;
  for (const std::string& text : texts) capabilities.push_back(clean(text, max_name_bytes));
  return capabilities;
}

// One overload per message: our struct into the envelope.
struct Encoder {
  pb::Envelope& out;

  void operator()(const Unknown&) const {}
  void operator()(const Hello& m) const {
    auto& to = *out.mutable_hello();
    to.set_major(m.major);
    to.set_minor(m.minor);
    to.set_device_name(clean(m.device_name, max_name_bytes));
    for (const std::string& one : m.capabilities) to.add_capabilities(clean(one, max_name_bytes));
    to.set_deadline_ms(m.deadline_ms);
  }
  void operator()(const Welcome& m) const {
    auto& to = *out.mutable_welcome();
    to.set_major(m.major);
    to.set_minor(m.minor);
    for (const std::string& one : m.capabilities) to.add_capabilities(clean(one, max_name_bytes));
    to.set_deadline_ms(m.deadline_ms);
  }
  void operator()(const Refused& m) const {
    auto& to = *out.mutable_refused();
    to.set_reason(clean(m.reason));
    to.set_permanent(m.permanent);
  }
  void operator()(const Ping&) const { out.mutable_ping(); }
  void operator()(const Pong&) const { out.mutable_pong(); }
  void operator()(const Credit& m) const { out.mutable_credit()->set_bytes(m.bytes); }
  void operator()(const ScanOpen& m) const {
    auto& to = *out.mutable_scan_open();
    to.set_scan(m.scan);
    to.set_description(m.description);
  }
  void operator()(const ScanState& m) const {
    auto& to = *out.mutable_scan_state();
    to.set_scan(m.scan);
    to.set_phase(static_cast<pb::ScanPhase>(m.phase));
    to.set_text(clean(m.text));
    for (const HeldFile& file : m.files) {
      auto& held = *to.add_files();
      put(*held.mutable_file(), file.file);
      held.set_held(file.held);
      held.set_stored(file.stored);
    }
  }
  void operator()(FileChunk& m) const {
    auto& to = *out.mutable_file_chunk();
    to.set_scan(m.scan);
    put(*to.mutable_file(), m.file);
    to.set_offset(m.offset);
    to.set_data(std::move(m.data));
  }
  void operator()(const FileAck& m) const {
    auto& to = *out.mutable_file_ack();
    to.set_scan(m.scan);
    to.set_name(m.name);
    to.set_sha256(m.sha256);
  }
  void operator()(const FileResume& m) const {
    auto& to = *out.mutable_file_resume();
    to.set_scan(m.scan);
    to.set_name(m.name);
    to.set_sha256(m.sha256);
    to.set_offset(m.offset);
  }
  void operator()(const Discard& m) const {
    auto& to = *out.mutable_discard();
    to.set_scan(m.scan);
    to.set_name(m.name);
  }
  void operator()(const ScanClose& m) const {
    auto& to = *out.mutable_scan_close();
    to.set_scan(m.scan);
    for (const FileEntry& file : m.files) put(*to.add_files(), file);
  }
  void operator()(const StageProgress& m) const {
    auto& to = *out.mutable_stage_progress();
    to.set_scan(m.scan);
    to.set_stage(clean(m.stage, max_name_bytes));
    to.set_fraction(m.fraction);
    to.set_text(clean(m.text));
  }
  void operator()(const ResultOffer& m) const {
    auto& to = *out.mutable_result_offer();
    to.set_scan(m.scan);
    for (const FileEntry& file : m.files) put(*to.add_files(), file);
  }
  void operator()(const ResultRequest& m) const {
    auto& to = *out.mutable_result_request();
    to.set_scan(m.scan);
    to.set_name(m.name);
    to.set_sha256(m.sha256);
    to.set_offset(m.offset);
  }
  void operator()(ResultChunk& m) const {
    auto& to = *out.mutable_result_chunk();
    to.set_scan(m.scan);
    to.set_name(m.name);
    to.set_sha256(m.sha256);
    to.set_offset(m.offset);
    to.set_data(std::move(m.data));
  }
  void operator()(const ResultAck& m) const { out.mutable_result_ack()->set_scan(m.scan); }
  void operator()(const PairRequest& m) const {
    auto& to = *out.mutable_pair_request();
    to.set_device_name(m.device_name);
    to.set_public_key(m.public_key);
    to.set_session(m.session);
    to.set_share(m.share);
  }
  void operator()(const PairAnswer& m) const {
    auto& to = *out.mutable_pair_answer();
    to.set_public_key(m.public_key);
    to.set_share(m.share);
  }
  void operator()(const PairProof& m) const { out.mutable_pair_proof()->set_tag(m.tag); }
  void operator()(const PairDone& m) const { out.mutable_pair_done()->set_tag(m.tag); }
  void operator()(const DeviceStatus& m) const {
    auto& to = *out.mutable_device_status();
    to.set_state(clean(m.state, max_name_bytes));
    to.set_text(clean(m.text));
    to.set_scan(m.scan);
    to.set_free_bytes(m.free_bytes);
    to.set_waiting_scans(m.waiting_scans);
    to.set_waiting_files(m.waiting_files);
  }
  void operator()(const CoveragePreview& m) const {
    auto& to = *out.mutable_coverage_preview();
    to.set_scan(m.scan);
    to.set_pass(clean(m.pass, max_name_bytes));
    for (const CoverageBand& band : m.bands) {
      auto& one = *to.add_bands();
      one.set_name(clean(band.name, max_name_bytes));
      one.set_share(band.share);
      one.set_cells(band.cells);
    }
  }
};

// The envelope's message as our struct; its text is made fit to show, its other fields are not checked yet.
Message message_of(pb::Envelope& envelope) {
  switch (envelope.body_case()) {
    case pb::Envelope::kHello: {
      const auto& m = envelope.hello();
      return Hello{m.major(), m.minor(), clean(m.device_name(), max_name_bytes), capabilities_of(m.capabilities()),
                   m.deadline_ms()};
    }
    case pb::Envelope::kWelcome: {
      const auto& m = envelope.welcome();
      return Welcome{m.major(), m.minor(), capabilities_of(m.capabilities()), m.deadline_ms()};
    }
    case pb::Envelope::kRefused:
      return Refused{clean(envelope.refused().reason()), envelope.refused().permanent()};
    case pb::Envelope::kPing:
      return Ping{};
    case pb::Envelope::kPong:
      return Pong{};
    case pb::Envelope::kCredit:
      return Credit{envelope.credit().bytes()};
    case pb::Envelope::kScanOpen:
      return ScanOpen{envelope.scan_open().scan(), envelope.scan_open().description()};
    case pb::Envelope::kScanState: {
      const auto& m = envelope.scan_state();
      ScanState state{m.scan(), static_cast<ScanPhase>(m.phase()), clean(m.text()), {}};
      for (const auto& held : m.files()) state.files.push_back({entry_of(held.file()), held.held(), held.stored()});
      return state;
    }
    case pb::Envelope::kFileChunk: {
      auto& m = *envelope.mutable_file_chunk();
      return FileChunk{m.scan(), entry_of(m.file()), m.offset(), std::move(*m.mutable_data())};
    }
    case pb::Envelope::kFileAck: {
      const auto& m = envelope.file_ack();
      return FileAck{m.scan(), m.name(), m.sha256()};
    }
    case pb::Envelope::kFileResume: {
      const auto& m = envelope.file_resume();
      return FileResume{m.scan(), m.name(), m.sha256(), m.offset()};
    }
    case pb::Envelope::kDiscard:
      return Discard{envelope.discard().scan(), envelope.discard().name()};
    case pb::Envelope::kScanClose: {
      ScanClose close{envelope.scan_close().scan(), {}};
      for (const auto& file : envelope.scan_close().files()) close.files.push_back(entry_of(file));
      return close;
    }
    case pb::Envelope::kStageProgress: {
      const auto& m = envelope.stage_progress();
      return StageProgress{m.scan(), clean(m.stage(), max_name_bytes), m.fraction(), clean(m.text())};
    }
    case pb::Envelope::kResultOffer: {
      ResultOffer offer{envelope.result_offer().scan(), {}};
      for (const auto& file : envelope.result_offer().files()) offer.files.push_back(entry_of(file));
      return offer;
    }
    case pb::Envelope::kResultRequest: {
      const auto& m = envelope.result_request();
      return ResultRequest{m.scan(), m.name(), m.sha256(), m.offset()};
    }
    case pb::Envelope::kResultChunk: {
      auto& m = *envelope.mutable_result_chunk();
      return ResultChunk{m.scan(), m.name(), m.sha256(), m.offset(), std::move(*m.mutable_data())};
    }
    case pb::Envelope::kResultAck:
      return ResultAck{envelope.result_ack().scan()};
    case pb::Envelope::kPairRequest: {
      const auto& m = envelope.pair_request();
      return PairRequest{m.device_name(), m.public_key(), m.session(), m.share()};
    }
    case pb::Envelope::kPairAnswer:
      return PairAnswer{envelope.pair_answer().public_key(), envelope.pair_answer().share()};
    case pb::Envelope::kPairProof:
      return PairProof{envelope.pair_proof().tag()};
    case pb::Envelope::kPairDone:
      return PairDone{envelope.pair_done().tag()};
    case pb::Envelope::kDeviceStatus: {
      const auto& m = envelope.device_status();
      return DeviceStatus{clean(m.state(), max_name_bytes),
                          clean(m.text()),
                          m.scan(),
                          m.free_bytes(),
                          m.waiting_scans(),
                          m.waiting_files()};
    }
    case pb::Envelope::kCoveragePreview: {
      const auto& m = envelope.coverage_preview();
      CoveragePreview preview{m.scan(), clean(m.pass(), max_name_bytes), {}};
      for (const auto& band : m.bands()) {
        preview.bands.push_back({clean(band.name(), max_name_bytes), band.share(), band.cells()});
      }
      return preview;
    }
    case pb::Envelope::BODY_NOT_SET:
      break;
  }
  return Unknown{};
}

// The first field outside its limits, or nothing.
struct Checker {
  using Fault = const char*;

  static Fault entry(const FileEntry& file) {
    if (!is_file(file.name)) return "file name";
    return is_hash(file.sha256) ? nullptr : "hash";
  }
  static Fault entries(const std::vector<FileEntry>& files) {
    if (files.size() > max_files) return "number of files";
    for (const FileEntry& file : files) {
      if (const Fault fault = entry(file)) return fault;
    }
    return nullptr;
  }
  static Fault file(const std::string& name, const std::string& sha256) {
    if (!is_file(name)) return "file name";
    return is_hash(sha256) ? nullptr : "hash";
  }
  static Fault scan(const std::string& id) { return is_ulid(id) ? nullptr : "scan id"; }

  Fault operator()(const Hello& m) const { return abilities(m.capabilities); }
  Fault operator()(const Welcome& m) const { return abilities(m.capabilities); }
  Fault operator()(const ScanOpen& m) const {
    return m.description.size() > max_description_bytes ? "description" : scan(m.scan);
  }
  Fault operator()(const ScanState& m) const {
    if (m.phase < ScanPhase::receiving || m.phase > ScanPhase::refused) return "phase";
    if (m.files.size() > max_files) return "number of files";
    for (const HeldFile& held : m.files) {
      if (const Fault fault = entry(held.file)) return fault;
      if (held.held > held.file.size) return "size held";
    }
    return scan(m.scan);
  }
  Fault operator()(const FileChunk& m) const {
    if (m.data.size() > max_chunk_bytes) return "chunk size";
    if (m.offset > m.file.size || m.data.size() > m.file.size - m.offset) return "chunk offset";
    if (m.data.empty() && m.file.size > 0) return "chunk size";
    if (const Fault fault = entry(m.file)) return fault;
    return scan(m.scan);
  }
  Fault operator()(const FileAck& m) const { return fault_of(m.scan, file(m.name, m.sha256)); }
  Fault operator()(const FileResume& m) const { return fault_of(m.scan, file(m.name, m.sha256)); }
  Fault operator()(const Discard& m) const { return fault_of(m.scan, is_file(m.name) ? nullptr : "file name"); }
  Fault operator()(const ScanClose& m) const { return fault_of(m.scan, entries(m.files)); }
  Fault operator()(const StageProgress& m) const { return std::isfinite(m.fraction) ? scan(m.scan) : "fraction"; }
  Fault operator()(const ResultOffer& m) const { return fault_of(m.scan, entries(m.files)); }
  Fault operator()(const ResultRequest& m) const { return fault_of(m.scan, file(m.name, m.sha256)); }
  Fault operator()(const ResultChunk& m) const {
    return m.data.size() > max_chunk_bytes ? "chunk size" : fault_of(m.scan, file(m.name, m.sha256));
  }
  Fault operator()(const ResultAck& m) const { return scan(m.scan); }
  Fault operator()(const PairRequest& m) const {
    if (!is_device_name(m.device_name)) return "device name";
    if (m.session.size() != pair_session_bytes) return "session";
    return pairing(m.public_key, m.share);
  }
  Fault operator()(const PairAnswer& m) const { return pairing(m.public_key, m.share); }
  Fault operator()(const PairProof& m) const { return tag_size(m.tag); }
  Fault operator()(const PairDone& m) const { return tag_size(m.tag); }
  Fault operator()(const DeviceStatus& m) const { return m.scan.empty() ? nullptr : scan(m.scan); }
  Fault operator()(const CoveragePreview& m) const {
    if (m.bands.size() > max_bands) return "number of bands";
    for (const CoverageBand& band : m.bands) {
      if (band.cells.size() > max_cells) return "number of cells";
      if (!(band.share >= 0.0 && band.share <= 1.0)) return "share";
    }
    return scan(m.scan);
  }
  template <class Other>
  Fault operator()(const Other& /*has nothing to check*/) const {
    return nullptr;
  }

 private:
  static Fault pairing(const std::string& public_key, const std::string& share) {
    if (!is_public_key(public_key)) return "public key";
    return share.size() == cpace_share_bytes ? nullptr : "share";
  }
  static Fault abilities(const Capabilities& capabilities) {
    return capabilities.size() > max_capabilities ? "number of capabilities" : nullptr;
  }
  static Fault tag_size(const std::string& tag) { return tag.size() == cpace_tag_bytes ? nullptr : "proof"; }
  static Fault fault_of(const std::string& id, Fault fault) { return fault ? fault : scan(id); }
};

}  // namespace

bool has(const Capabilities& capabilities, std::string_view one) {
  return std::find(capabilities.begin(), capabilities.end(), one) != capabilities.end();
}

std::string encode(Message message) {
  pb::Envelope envelope;
  std::visit(Encoder{envelope}, message);
  return envelope.SerializeAsString();
}

Result<Message> decode(std::string_view bytes) {
  if (bytes.size() > max_message_bytes) return fail("malformed message", "larger than a message may be");
  pb::Envelope envelope;
  if (!envelope.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return fail("malformed message", "not a message of this protocol");
  }
  Message message = message_of(envelope);
  if (const char* fault = std::visit(Checker{}, message)) {
    return fail("malformed message", std::string("unacceptable ") + fault);
  }
  return message;
}

bool is_bundle_file(std::string_view name) {
  if (name == "scan.json" || name == "frames.jsonl") return true;
  constexpr std::string_view folder = "frames/";
  if (name.size() > max_name_bytes || !name.starts_with(folder)) return false;
  name.remove_prefix(folder.size());
  const std::optional<FrameId> id = parse_frame_name(name);
  return id && id->index >= 0 && frame_name(id->pass, id->index) == name;
}

bool is_result_file(std::string_view name) {
  return name.size() <= max_name_bytes && is_safe_name(name) && name != "scan.json" && !name.ends_with(".jsonl");
}

}  // namespace gyre::wire
