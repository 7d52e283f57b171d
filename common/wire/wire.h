// SPDX-License-Identifier: Apache-2.0
// The messages between device and host as plain structs, and their encoding (Protocol Buffers, gyre.proto).
//
// A conversation is one connection. The device speaks first:
//
//   device                                host
//   Hello                              ▶    Refused, or Welcome and the first Credit
//   ScanOpen, for every unfinished scan ▶   ScanState: what is held of it already
//   FileChunk ... while credit lasts   ▶    Credit for bytes written, FileAck for a file synced, FileResume after a gap
//   Discard                            ▶
//   ScanClose with the manifest        ▶    ScanState: queued, or receiving with what is still missing
//                                      ◀    StageProgress ..., ResultOffer (or ScanState: failed)
//   ResultRequest, one for every chunk ▶    ResultChunk
//   ResultAck                          ▶
//   DeviceStatus, CoveragePreview      ▶         when the host can take them
//   Ping                               ▶    Pong
//
// A pairing is a conversation of its own, on a socket that takes nothing else (common/wire/pairing.h):
//
//   PairRequest                        ▶    PairAnswer
//   PairProof                          ▶    PairDone, or Refused
#pragma once

#include "common/result/result.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace gyre::wire {

constexpr std::uint32_t protocol_major = 1;  // must be equal at both ends
constexpr std::uint32_t protocol_minor = 1;

// Limits both ends enforce when decoding.
constexpr std::size_t max_message_bytes = 1 << 20;
constexpr std::size_t max_chunk_bytes = 256 << 10;
constexpr std::size_t max_files = 4096;       // of one scan
constexpr std::size_t max_name_bytes = 128;   // file, stage and device names
constexpr std::size_t max_text_bytes = 4096;  // reasons and progress texts; longer ones are cut when encoding
constexpr std::size_t max_description_bytes = 256 << 10;

// What a peer can do beyond the first version of its protocol, by name. What the other does not know, it ignores.
using Capabilities = std::vector<std::string>;
constexpr std::string_view takes_status = "status";      // a host: DeviceStatus
constexpr std::string_view takes_coverage = "coverage";  // a host: CoveragePreview

bool has(const Capabilities& capabilities, std::string_view one);

// First word of the device: its protocol and its name. The name is for people; the CURVE key is what identifies it.
struct Hello {
  std::uint32_t major = protocol_major;
  std::uint32_t minor = protocol_minor;
  std::string device_name;
  Capabilities capabilities = {};
  std::uint32_t deadline_ms = 0;  // when it has said nothing for that long, it is gone; 0: as the host sees fit
};

struct Welcome {
  std::uint32_t major = protocol_major;
  std::uint32_t minor = protocol_minor;
  Capabilities capabilities = {};
  std::uint32_t deadline_ms = 0;  // the device has to say something at least that often; 0: not known
};

// The conversation is over, for a reason an operator can read. permanent: trying again does not help until someone
// acts.
struct Refused {
  std::string reason;
  bool permanent = false;
};

struct Ping {};
struct Pong {};

// The device may send chunks costing `bytes` more; see cost_of.
struct Credit {
  std::uint64_t bytes = 0;
};

// A scan the device has not finished with; description is its scan.json so far.
struct ScanOpen {
  std::string scan;
  std::string description;
};

struct FileEntry {
  std::string name;  // relative to the bundle
  std::uint64_t size = 0;
  std::string sha256;
};

// What the host has of a file: its first `held` bytes (file.size is `held` then), or all of it synced and acknowledged.
struct HeldFile {
  FileEntry file;
  std::uint64_t held = 0;
  bool stored = false;
};

enum class ScanPhase { receiving, queued, running, done, failed, refused };

// What the host has of a scan; text says why when it failed or is refused. files: only while receiving.
struct ScanState {
  std::string scan;
  ScanPhase phase = ScanPhase::receiving;
  std::string text;
  std::vector<HeldFile> files;
};

// Bytes [offset, offset + data.size()) of a file. Every chunk describes its file, so none depends on one before it.
struct FileChunk {
  std::string scan;
  FileEntry file;
  std::uint64_t offset = 0;
  std::string data;
};

// The file with that content is synced to the host's disk and catalogued.
struct FileAck {
  std::string scan, name, sha256;
};

// Send that content again from `offset` on: chunks were lost, or the whole did not match its hash (offset 0).
struct FileResume {
  std::string scan, name, sha256;
  std::uint64_t offset = 0;
};

// The selection dropped this candidate; it need not be kept. A hint: the manifest of ScanClose decides.
struct Discard {
  std::string scan, name;
};

// The scan is complete; these files, no others, make the bundle.
struct ScanClose {
  std::string scan;
  std::vector<FileEntry> files;
};

struct StageProgress {
  std::string scan;
  std::string stage;
  double fraction = 0.0;  // of the stage, in [0, 1]
  std::string text;
};

// The reconstruction is done and left these files.
struct ResultOffer {
  std::string scan;
  std::vector<FileEntry> files;
};

// Asks for one chunk of a result; the device bounds what is under way by how many it asks for at a time.
struct ResultRequest {
  std::string scan, name, sha256;
  std::uint64_t offset = 0;
};

struct ResultChunk {
  std::string scan, name, sha256;
  std::uint64_t offset = 0;
  std::string data;
};

// The device has synced all results to its disk.
struct ResultAck {
  std::string scan;
};

// A device asks to be let in. session: random bytes; share: its part of the key exchange (common/keys/cpace.h).
struct PairRequest {
  std::string device_name;
  std::string public_key;  // Z85
  std::string session;
  std::string share;
};

struct PairAnswer {
  std::string public_key;  // of the host
  std::string share;
};

// Shows that the device knows the code.
struct PairProof {
  std::string tag;
};

// The device is on the list; shows that the host knows the code.
struct PairDone {
  std::string tag;
};

constexpr std::size_t pair_session_bytes = 16;

// How a device is, for those who look at the host; only the latest counts.
struct DeviceStatus {
  std::string state;                // a word: "ready", "recording"
  std::string text;                 // a sentence for the operator; may be empty
  std::string scan;                 // being recorded; empty: none
  std::uint64_t free_bytes = 0;     // on the disk of its spool
  std::uint32_t waiting_scans = 0;  // that the host does not have whole
  std::uint32_t waiting_files = 0;  // of those
};

// One ring of a pass, seen from above: a cell for every sector, ascending from where the pass began.
struct CoverageBand {
  std::string name;    // "body upper"
  double share = 0.0;  // of what it needs, in [0, 1]
  std::string cells;   // one byte each: 0 not seen yet, 255 as sharp as can be
};

// What a scan that is being recorded has seen so far; only the latest counts.
struct CoveragePreview {
  std::string scan;
  std::string pass;
  std::vector<CoverageBand> bands;
};

constexpr std::size_t max_capabilities = 32;
constexpr std::size_t max_bands = 16;
constexpr std::size_t max_cells = 360;  // of a band

// A message of a newer minor version: to be ignored.
struct Unknown {};

using Message =
    std::variant<Unknown, Hello, Welcome, Refused, Ping, Pong, Credit, ScanOpen, ScanState, FileChunk, FileAck,
                 FileResume, Discard, ScanClose, StageProgress, ResultOffer, ResultRequest, ResultChunk, ResultAck,
                 PairRequest, PairAnswer, PairProof, PairDone, DeviceStatus, CoveragePreview>;

// The bytes of one ZeroMQ message.
std::string encode(Message message);

// Error: too large, not a message, or a field outside its limits (ids, names, hashes, sizes). Whatever the bytes are,
// a decoded message has a well-formed scan id, safe file names and chunks that lie inside their file.
Result<Message> decode(std::string_view bytes);

// What a chunk takes from the credit: its data and a flat share for the message around it, so that credit also bounds
// the number of messages under way.
constexpr std::uint64_t chunk_overhead = 4096;
constexpr std::uint64_t cost_of(std::uint64_t data_bytes) {
  return data_bytes + chunk_overhead;
}

// True for the files a device sends: scan.json, frames.jsonl and keyframes.
bool is_bundle_file(std::string_view name);

// True for a file a host may offer as result: a plain name in the bundle's root that is not one of the above.
bool is_result_file(std::string_view name);

}  // namespace gyre::wire
