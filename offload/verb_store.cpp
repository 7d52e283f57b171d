// SPDX-License-Identifier: Apache-2.0
#include "offload/store/receipts.h"
#include "offload/store/store.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

using nlohmann::json;

struct StoreFlags {
  std::string store;
  std::vector<std::string> scans;
  std::string to = ".";               // folder of what is exported
  std::vector<std::string> archives;  // to be imported
  double days = 0;                    // 0: no limit
  int most = -1;                      // -1: no limit
  bool dry_run = false;
};

int with_store(const StoreFlags& given, const std::function<Result<bool>(Store&)>& work) {
  const Result<std::unique_ptr<Store>> store = Store::open(given.store);
  if (!store) return report_error(store.error());
  const Result<bool> good = work(**store);
  return good ? (*good ? 0 : 1) : report_error(good.error());
}

void print(const json& line) {
  std::printf("%s\n", line.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
}

// The scans asked for, or all of them.
Result<std::vector<std::string>> chosen(const Store& store, const std::vector<std::string>& asked) {
  if (!asked.empty()) return asked;
  const Result<std::vector<StoredScan>> scans = store.scans();
  if (!scans) return tl::unexpected(scans.error());
  std::vector<std::string> ids;
  for (const StoredScan& scan : *scans) ids.push_back(scan.id);
  return ids;
}

Result<bool> list(const Store& store) {
  const Result<std::vector<StoredScan>> scans = store.scans();
  if (!scans) return tl::unexpected(scans.error());
  for (const StoredScan& scan : *scans) {
    const Result<std::vector<StoredFile>> files = store.files(scan.id);
    if (!files) return tl::unexpected(files.error());
    std::uint64_t bytes = 0;
    for (const StoredFile& file : *files) bytes += file.size;
    print({{"scan", scan.id},
           {"created", scan.created},
           {"device", scan.device_name},
           {"phase", name_of(scan.phase)},
           {"reason", scan.reason},
           {"delivered", scan.delivered},
           {"files", files->size()},
           {"bytes", bytes}});
  }
  return true;
}

Result<bool> verify(const Store& store, const std::vector<std::string>& asked) {
  const Result<std::vector<std::string>> ids = chosen(store, asked);
  if (!ids) return tl::unexpected(ids.error());
  bool all_good = true;
  for (const std::string& id : *ids) {
    const Result<std::optional<StoredScan>> known = store.scan(id);
    if (!known) return tl::unexpected(known.error());
    if (!*known) return fail("no such scan in the store", id, "`gyre-offload store list` names them");
    const Result<std::vector<std::string>> faults = store.verify(id);
    if (!faults) return tl::unexpected(faults.error());
    all_good = all_good && faults->empty();
    print({{"scan", id}, {"whole", faults->empty()}, {"faults", *faults}});
  }
  return all_good;
}

Result<bool> remove(Store& store, const std::vector<std::string>& ids) {
  for (const std::string& id : ids) {
    const Result<DeletionReceipt> receipt = store.delete_scan(id);
    if (!receipt) return tl::unexpected(receipt.error());
    print(to_json(*receipt));
  }
  return true;
}

Result<bool> export_scans(const Store& store, const StoreFlags& given) {
  const Result<std::vector<std::string>> ids = chosen(store, given.scans);
  if (!ids) return tl::unexpected(ids.error());
  for (const std::string& id : *ids) {
    const std::filesystem::path tar = std::filesystem::path(given.to) / (id + ".tar");
    if (Result<void> done = store.export_scan(id, tar); !done) return tl::unexpected(done.error());
    std::error_code error;
    print({{"scan", id}, {"archive", tar.string()}, {"bytes", std::filesystem::file_size(tar, error)}});
  }
  return true;
}

Result<bool> import_scans(Store& store, const StoreFlags& given) {
  for (const std::string& tar : given.archives) {
    const Result<std::string> id = store.import_scan(tar);
    if (!id) return tl::unexpected(id.error());
    print({{"scan", *id}, {"archive", tar}});
  }
  return true;
}

Result<bool> prune(Store& store, const StoreFlags& given) {
  constexpr double hours_a_day = 24.0;
  RetentionPolicy policy;
  if (given.days > 0) policy.longest = std::chrono::hours(std::lround(hours_a_day * given.days));
  if (given.most >= 0) policy.most = static_cast<std::size_t>(given.most);
  if (policy.keeps_everything()) return wrong_use("nothing says what may go", "", "give --days, --keep or both");
  const Result<std::vector<std::string>> ids = store.expired(policy, wall_time_now());
  if (!ids) return tl::unexpected(ids.error());
  if (!given.dry_run) return remove(store, *ids);
  for (const std::string& id : *ids) print({{"would_delete", id}});
  return true;
}

void add_store_option(CLI::App& verb, StoreFlags& flags) {
  verb.add_option("--store", flags.store, "folder of the catalogue and the scans")->required();
}

}  // namespace

void add_store_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<StoreFlags>();
  CLI::App* verb = app.add_subcommand("store", "look after the scans of a host that is not serving");
  verb->require_subcommand(1);

  CLI::App* listing = verb->add_subcommand("list", "print every scan with its state, one JSON object a line");
  add_store_option(*listing, *flags);
  listing->callback([flags, &run] { run = [flags] { return with_store(*flags, list); }; });

  CLI::App* verifying = verb->add_subcommand("verify", "read every file and compare it with its hash");
  add_store_option(*verifying, *flags);
  verifying->add_option("SCAN", flags->scans, "scans to look at; default: all");
  verifying->callback([flags, &run] {
    run = [flags] { return with_store(*flags, [flags](const Store& store) { return verify(store, flags->scans); }); };
  });

  CLI::App* exporting = verb->add_subcommand("export", "write each scan into one file, SCAN.tar");
  add_store_option(*exporting, *flags);
  exporting->add_option("--to", flags->to, "folder for the files")->capture_default_str();
  exporting->add_option("SCAN", flags->scans, "scans to export; default: all");
  exporting->callback([flags, &run] {
    run = [flags] { return with_store(*flags, [flags](const Store& store) { return export_scans(store, *flags); }); };
  });

  CLI::App* importing = verb->add_subcommand("import", "take in scans that were exported, here or elsewhere");
  add_store_option(*importing, *flags);
  importing->add_option("FILE", flags->archives, "files that export wrote")->required();
  importing->callback([flags, &run] {
    run = [flags] { return with_store(*flags, [flags](Store& store) { return import_scans(store, *flags); }); };
  });

  CLI::App* pruning = verb->add_subcommand(
      "prune", "delete scans that have been kept long enough, of those only whose results are with their device");
  add_store_option(*pruning, *flags);
  pruning->add_option("--days", flags->days, "days after delivery that a scan may stay; default: no limit")
      ->check(CLI::Range(0.0, 1e5));
  pruning->add_option("--keep", flags->most, "delivered scans that may stay, the newest; default: no limit")
      ->check(CLI::Range(0, 1'000'000'000));
  pruning->add_flag("--dry-run", flags->dry_run, "only say what would go");
  pruning->callback([flags, &run] {
    run = [flags] { return with_store(*flags, [flags](Store& store) { return prune(store, *flags); }); };
  });

  CLI::App* deleting = verb->add_subcommand(
      "delete", "remove scans and everything made of them for good; prints a receipt with every file that went");
  add_store_option(*deleting, *flags);
  deleting->add_option("SCAN", flags->scans, "scans to delete")->required();
  deleting->callback([flags, &run] {
    run = [flags] { return with_store(*flags, [flags](Store& store) { return remove(store, flags->scans); }); };
  });
}

}  // namespace gyre
