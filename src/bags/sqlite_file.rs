//! Reads one SQLite file, the default format of `ros2 bag record` in Humble.

use super::block::{Block, Types, Unpacked, of_other_encoding};
use super::error::BagError;
use super::format::Format;
use super::message::{BagMessage, Topic};
use super::metadata;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::Type;
use rusqlite::{Connection, OpenFlags, Row, Statement};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// The number of messages in a block.
const PAGE: usize = 500;

/// The size of the longest message that is read \[bytes\].
const MESSAGE_LIMIT: i32 = 128 * 1024 * 1024;

/// An open SQLite file.
#[derive(Debug)]
pub(super) struct SqliteFile {
    connection: Connection,
    topics: Topics,
    /// The rows of all messages, in the order of time.
    order: Vec<MessageRow>,
    /// The folder with a copy of the database, if a copy was necessary. The folder is deleted when this value is dropped.
    _copy: Option<TempDir>,
}

/// The row of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct MessageRow {
    /// The log time \[ns\].
    log_time: i64,
    id: i64,
}

/// The topics by id.
#[derive(Debug, Default)]
struct Topics(BTreeMap<i64, Entry>);

#[derive(Debug)]
struct Entry {
    name: Arc<str>,
    message: Arc<str>,
    /// Whether the encoding is CDR. Other middleware has other encodings.
    is_cdr: bool,
    count: u64,
}

impl SqliteFile {
    /// Opens the database `data` without changing it. `data` is the file `path` of the bag, or an unpacked copy of this file. Errors
    /// name `path`. Calls `lost` with a description of each incomplete part.
    ///
    /// # Errors
    /// [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path, data: &Path, mut lost: impl FnMut(String)) -> Result<Self, BagError> {
        let damaged = |why: rusqlite::Error| BagError::damaged(path, &why.to_string());
        let is_unfinished = |ending: &str| {
            let beside = beside(path, ending);
            std::fs::metadata(&beside).is_ok_and(|file| file.is_file() && file.len() > 0).then_some(beside)
        };
        let log = is_unfinished(LOG);
        let copy = match log.as_deref().map(|log| copied(data, log)).transpose() {
            Ok(copy) => copy,
            Err(why) => {
                lost(format!("what its recorder left in {log:?} is not read: {why}"));
                None
            }
        };
        let connection = match &copy {
            Some(folder) => connect(&folder.path().join(COPY), false),
            None => connect(data, true),
        };
        let connection = connection.map_err(damaged)?;
        let is_missing = log.is_none() && has_log(data);
        if let Some(why) = why_foreign(&connection).map_err(damaged)? {
            let why = if is_missing { LOG_IS_MISSING } else { why };
            return Err(BagError::not_a_bag(path, why));
        }
        let topics = read_topics(&connection).map_err(damaged)?;
        let order = read_order(&connection, &mut lost).map_err(damaged)?;
        if let Some(log) = log.filter(|_| copy.is_some()) {
            lost(format!("its recorder has not ended it: it is read up to the last commit in {log:?}"));
        }
        // A recorder that has ended the bag properly has written metadata, and has removed its write-ahead log.
        if is_missing && !path.with_file_name(metadata::FILE_NAME).exists() {
            lost(LOG_IS_MISSING.to_owned());
        }
        if let Some(journal) = is_unfinished("-journal") {
            lost(format!("its recorder has not finished it: what is only in {journal:?} is not read"));
        }
        Ok(Self { connection, topics, order, _copy: copy })
    }
}

impl Format for SqliteFile {
    fn blocks(&self) -> Vec<Block> {
        let pages = self.order.chunks(PAGE).enumerate();
        pages
            .map(|(number, page)| Block { start: page.first().map_or(0, |row| row.log_time), number })
            .collect()
    }

    fn topics(&self) -> Vec<Topic> {
        let topic = |entry: &Entry| Topic {
            name: entry.name.to_string(),
            message: entry.message.to_string(),
            count: entry.count,
        };
        self.topics.0.values().filter(|entry| entry.is_cdr).map(topic).collect()
    }

    fn missing(&self) -> Vec<String> {
        let others = self.topics.0.values().filter(|entry| !entry.is_cdr && entry.count > 0);
        others.map(|entry| of_other_encoding(&entry.name, entry.count)).collect()
    }

    fn load(&mut self, number: usize, types: &Types, limit: u64) -> Unpacked {
        let mut unpacked = Unpacked::default();
        let page = self.order.chunks(PAGE).nth(number).unwrap_or_default();
        let mut statement =
            match self.connection.prepare("SELECT topic_id, data FROM messages NOT INDEXED WHERE id = ?1") {
                Ok(statement) => statement,
                Err(why) => {
                    unpacked.lost.push(format!("{} messages cannot be read: {why}", page.len()));
                    return unpacked;
                }
            };
        let (mut damaged, mut last_reason) = (0, String::new());
        for row in page {
            match self.topics.read(&mut statement, *row, types, limit - unpacked.bytes) {
                Ok(message) => {
                    unpacked.bytes += message.as_ref().map_or(0, |message| message.cdr.len() as u64);
                    unpacked.messages.extend(message);
                }
                Err(why) => (damaged, last_reason) = (damaged + 1, why.to_string()),
            }
        }
        if damaged > 0 {
            unpacked.lost.push(format!("{damaged} messages cannot be read: {last_reason}"));
        }
        unpacked
    }
}

impl Topics {
    /// Returns the message with this time and id. `None` if its topic is unknown, if it is not encoded in CDR, or if its type was
    /// not requested.
    fn read(
        &mut self,
        statement: &mut Statement,
        MessageRow { log_time, id }: MessageRow,
        types: &Types,
        limit: u64,
    ) -> rusqlite::Result<Option<BagMessage>> {
        statement.query_row([id], |row| {
            let Some(entry) = self.0.get_mut(&row.get(0)?) else { return Ok(None) };
            if !entry.is_cdr
                || types.as_ref().is_some_and(|types| types.iter().all(|name| **name != *entry.message))
            {
                entry.count += 1;
                return Ok(None);
            }
            let data = row.get_ref(1)?.as_blob()?;
            if data.len() as u64 > limit {
                return Err(rusqlite::Error::InvalidColumnType(1, "data, too long".to_owned(), Type::Blob));
            }
            entry.count += 1;
            let (topic, message) = (entry.name.clone(), entry.message.clone());
            Ok(Some(BagMessage { topic, message, log_time, cdr: data.to_vec() }))
        })
    }
}

/// Returns the reason why the database cannot come from rosbag2; `None` if it can. A database with virtual tables or generated
/// columns is refused too, because their values could have any size.
fn why_foreign(connection: &Connection) -> rusqlite::Result<Option<&'static str>> {
    let count = |query: &str| connection.query_row(query, [], |row| row.get::<_, i64>(0));
    let tables = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages') AND rootpage > 0";
    if count(tables)? != 2 {
        return Ok(Some("it has no tables `topics` and `messages`"));
    }
    let computed = "SELECT (SELECT count(*) FROM pragma_table_xinfo('messages') WHERE hidden > 0) \
                    + (SELECT count(*) FROM pragma_table_xinfo('topics') WHERE hidden > 0)";
    Ok((count(computed)? > 0).then_some("its tables have generated columns, which rosbag2's have not"))
}

fn read_topics(connection: &Connection) -> rusqlite::Result<Topics> {
    let query = "SELECT id, name, type, serialization_format IS 'cdr' FROM topics NOT INDEXED";
    let mut statement = connection.prepare(query)?;
    let entry = |row: &Row| {
        let (name, message): (String, String) = (row.get(1)?, row.get(2)?);
        Ok((row.get(0)?, Entry { name: name.into(), message: message.into(), is_cdr: row.get(3)?, count: 0 }))
    };
    Ok(Topics(statement.query_map([], entry)?.collect::<rusqlite::Result<_>>()?))
}

/// Reads the rows of all messages, and returns them in the order of time and id. If a part of the table is damaged, first reads the
/// rows before the damage. Then reads the table backwards from its end, to get the rows after the damage.
fn read_order(connection: &Connection, lost: &mut impl FnMut(String)) -> rusqlite::Result<Vec<MessageRow>> {
    let mut order = Vec::new();
    let up = "SELECT id, timestamp FROM messages NOT INDEXED ORDER BY id";
    if let Err(why) = read_rows(connection, up, None, &mut order) {
        let last = order.last().map(|row: &MessageRow| row.id);
        let down = "SELECT id, timestamp FROM messages NOT INDEXED ORDER BY id DESC";
        // Read backwards from the end. This reading stops at the same damage, or at a later one.
        let _ = read_rows(connection, down, last, &mut order);
        lost(format!("{why}: messages among those after number {} are lost", last.unwrap_or_default()));
    }
    order.sort_unstable();
    Ok(order)
}

/// Adds the rows of the query to `order`. Stops before the row with the id `end`. Stops also if the ids are not monotonic, because
/// the tree of rows in a damaged file could be circular.
fn read_rows(
    connection: &Connection,
    query: &str,
    end: Option<i64>,
    order: &mut Vec<MessageRow>,
) -> rusqlite::Result<()> {
    let mut statement = connection.prepare(query)?;
    let mut rows = statement.query([])?;
    let mut before: Option<(i64, std::cmp::Ordering)> = None;
    while let Some(row) = rows.next()? {
        let id: i64 = row.get(0)?;
        let way = before.map(|(before, _)| id.cmp(&before));
        let turned =
            before.zip(way).is_some_and(|((_, before), way)| way.is_eq() || before.is_ne() && before != way);
        if turned || end == Some(id) {
            return Ok(());
        }
        before = Some((id, way.unwrap_or(std::cmp::Ordering::Equal)));
        // A row is not a message if its time is not a number.
        order.extend(row.get(1).ok().map(|log_time| MessageRow { log_time, id }));
    }
    Ok(())
}

/// The ending of the name of a database's write-ahead log.
const LOG: &str = "-wal";

const LOG_IS_MISSING: &str = "its write-ahead log is missing (the same name, ending in -wal): the messages that were only in the log are lost";

/// The file name of the copy of a database.
const COPY: &str = "bag.db3";

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut beside = path.as_os_str().to_owned();
    beside.push(ending);
    beside.into()
}

/// Copies the database and its write-ahead log to a temporary folder, because opening a database with a log changes both files.
fn copied(data: &Path, log: &Path) -> std::io::Result<TempDir> {
    let folder = TempDir::new()?;
    let copy = folder.path().join(COPY);
    std::fs::copy(data, &copy)?;
    std::fs::copy(log, beside(&copy, LOG))?;
    Ok(folder)
}

/// Returns whether the database uses a write-ahead log, according to its header (SQLite's file format, 1.3.3).
fn has_log(data: &Path) -> bool {
    let mut head = [0; 20];
    let read = File::open(data).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head[18..] == [2, 2]
}

/// Opens the file without trusting its schema. If `is_in_place`, opens it read-only, without locks or journal files. Otherwise the
/// file is a copy, to which SQLite may write.
fn connect(path: &Path, is_in_place: bool) -> rusqlite::Result<Connection> {
    let connection = match is_in_place {
        true => {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
            Connection::open_with_flags(immutable(path), flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?
        }
        false => {
            let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
            Connection::open_with_flags(path, flags)?
        }
    };
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MESSAGE_LIMIT)?;
    Ok(connection)
}

/// Returns a URI of the file with the parameter `immutable`: nobody changes the file, so SQLite uses no locks and writes no files.
fn immutable(path: &Path) -> OsString {
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"/._-".contains(byte);
    let escape = |byte: u8| if plain(&byte) { char::from(byte).to_string() } else { format!("%{byte:02x}") };
    let path = path.as_os_str().as_bytes().iter().map(|byte| escape(*byte)).collect::<String>();
    OsString::from(format!("file:{path}?immutable=1"))
}

#[cfg(test)]
mod tests {
    use crate::Bag;
    use rusqlite::Connection;
    use std::collections::BTreeMap;
    use std::path::{Path, PathBuf};

    const KILLED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/cases/bags/wal_killed");

    /// Returns the files in a folder, with their contents.
    fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let files = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
        files.map(|file| (file.clone(), std::fs::read(file).unwrap())).collect()
    }

    fn copy(without: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (file, content) in files(Path::new(KILLED)) {
            let name = file.file_name().unwrap().to_str().unwrap();
            if !name.ends_with(without) {
                std::fs::write(folder.path().join(name), content).unwrap();
            }
        }
        folder
    }

    /// Returns the number of messages read, and the losses.
    fn read(path: &Path) -> (usize, Vec<String>) {
        let mut bag = Bag::open(path).unwrap();
        let count = bag.by_ref().count();
        (count, bag.losses().lines().collect())
    }

    #[test]
    fn the_write_ahead_log_of_a_killed_recorder_is_read_and_not_changed() {
        let folder = copy("-shm");
        let before = files(folder.path());
        let (count, losses) = read(folder.path());
        // sqlite3 (3.40) counts the same number in a copy.
        assert_eq!(count, COUNT);
        assert!(losses.len() == 1 && losses[0].contains("its recorder has not ended it"), "{losses:?}");
        assert_eq!(files(folder.path()), before);
        assert_eq!(read(&folder.path().join("run_0.db3")).0, COUNT, "the file alone");
        // If the log has an incomplete end, nothing is lost.
        let log = folder.path().join("run_0.db3-wal");
        let torn = [std::fs::read(&log).unwrap(), vec![7; 5000]].concat();
        std::fs::write(&log, torn).unwrap();
        assert_eq!(read(folder.path()).0, COUNT);
    }

    #[test]
    fn a_log_that_is_not_there_is_missed() {
        let folder = copy("-wal");
        let why = Bag::open(folder.path()).unwrap_err().to_string();
        assert!(why.contains("write-ahead log") && why.contains("-wal"), "{why}");
        // All messages are in the database itself.
        let folder = copy("-shm");
        let file = folder.path().join("run_0.db3");
        let connection = Connection::open(&file).unwrap();
        connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).unwrap();
        drop(connection);
        let (count, losses) = read(folder.path());
        assert_eq!(count, COUNT);
        assert!(losses.len() == 1 && losses[0].contains("only in the log"), "{losses:?}");
        // A recorder that has written metadata has ended the bag.
        let metadata = "rosbag2_bagfile_information:\n  relative_file_paths: [run_0.db3]\n";
        std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
        assert_eq!(read(folder.path()), (COUNT, Vec::new()));
    }

    const COUNT: usize = 900;
}
