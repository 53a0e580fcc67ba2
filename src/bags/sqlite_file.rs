//! Reads one SQLite file, as `ros2 bag record` of Humble writes by default.

use super::block::{Block, Types, Unpacked, of_other_encoding};
use super::error::BagError;
use super::message::{BagMessage, Topic};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::Type;
use rusqlite::{Connection, OpenFlags, Row, Statement};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::sync::Arc;

/// Rows of a block.
const PAGE: usize = 500;

/// The longest message \[bytes\].
const MESSAGE_LIMIT: i32 = 128 * 1024 * 1024;

/// A SQLite file that has been looked through.
#[derive(Debug)]
pub(super) struct SqliteFile {
    connection: Connection,
    topics: Topics,
    /// Time \[ns\] and id of every message, in order of time.
    order: Vec<(i64, i64)>,
}

/// By id.
#[derive(Debug, Default)]
struct Topics(BTreeMap<i64, Entry>);

#[derive(Debug)]
struct Entry {
    name: Arc<str>,
    message: Arc<str>,
    /// Other encodings than CDR are another middleware's.
    is_cdr: bool,
    count: u64,
}

impl SqliteFile {
    /// Looks through the file at `data`, which is not changed and called `path`; `lost` takes what of it is not whole.
    ///
    /// # Errors
    /// [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path, data: &Path, mut lost: impl FnMut(String)) -> Result<Self, BagError> {
        let damaged = |why: rusqlite::Error| BagError::damaged(path, &why.to_string());
        let connection = connect(data).map_err(damaged)?;
        if let Some(why) = stranger(&connection).map_err(damaged)? {
            return Err(BagError::not_a_bag(path, why));
        }
        let topics = read_topics(&connection).map_err(damaged)?;
        let order = read_order(&connection, &mut lost).map_err(damaged)?;
        for ending in ["-wal", "-journal"] {
            let mut beside = path.as_os_str().to_owned();
            beside.push(ending);
            if std::fs::metadata(&beside).is_ok_and(|metadata| metadata.len() > 0) {
                lost(format!("its recorder has not finished it: what is only in {beside:?} is not read"));
            }
        }
        Ok(Self { connection, topics, order })
    }

    /// Its messages by time, some at a time.
    pub fn blocks(&self) -> Vec<Block> {
        let pages = self.order.chunks(PAGE).enumerate();
        pages.map(|(number, page)| Block { start: page.first().map_or(0, |first| first.0), number }).collect()
    }

    /// Its topics.
    pub fn topics(&self) -> Vec<Topic> {
        let topic = |entry: &Entry| Topic {
            name: entry.name.to_string(),
            message: entry.message.to_string(),
            count: entry.count,
        };
        self.topics.0.values().filter(|entry| entry.is_cdr).map(topic).collect()
    }

    /// What was not read, a line each.
    pub fn missing(&self) -> Vec<String> {
        let others = self.topics.0.values().filter(|entry| !entry.is_cdr && entry.count > 0);
        others.map(|entry| of_other_encoding(&entry.name, entry.count)).collect()
    }

    /// The messages of a block, `limit` bytes of them at most.
    pub fn load(&mut self, number: usize, types: Types, limit: u64) -> Unpacked {
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
        for (time, id) in page {
            match self.topics.read(&mut statement, (*time, *id), types, limit - unpacked.bytes) {
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
    /// The message with that time and id, unless nobody wants it.
    fn read(
        &mut self,
        statement: &mut Statement,
        (log_time, id): (i64, i64),
        types: Types,
        limit: u64,
    ) -> rusqlite::Result<Option<BagMessage>> {
        statement.query_row([id], |row| {
            let Some(entry) = self.0.get_mut(&row.get(0)?) else { return Ok(None) };
            if !entry.is_cdr || types.is_some_and(|types| !types.contains(&&*entry.message)) {
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

/// Why the database is none of rosbag2's, if it is none. What is computed when it is read, as virtual tables and generated columns
/// are, could be of any size.
fn stranger(connection: &Connection) -> rusqlite::Result<Option<&'static str>> {
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

/// Time and id of every message by time; those of one time by id. Past damage it goes on from the other end.
fn read_order(connection: &Connection, lost: &mut impl FnMut(String)) -> rusqlite::Result<Vec<(i64, i64)>> {
    let mut order = Vec::new();
    let up = "SELECT id, timestamp FROM messages NOT INDEXED ORDER BY id";
    if let Err(why) = read_rows(connection, up, None, &mut order) {
        let last = order.last().map(|(_, id)| *id);
        let down = "SELECT id, timestamp FROM messages NOT INDEXED ORDER BY id DESC";
        // The same damage ends it, or another.
        let _ = read_rows(connection, down, last, &mut order);
        lost(format!("{why}: messages among those after number {} are lost", last.unwrap_or_default()));
    }
    order.sort_unstable();
    Ok(order)
}

/// Adds the rows that the query gives, until one with the id `end`. Ids go one way: a damaged tree could lead in circles.
fn read_rows(
    connection: &Connection,
    query: &str,
    end: Option<i64>,
    order: &mut Vec<(i64, i64)>,
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
        // A time that is no number is of no message.
        order.extend(row.get(1).ok().map(|time: i64| (time, id)));
    }
    Ok(())
}

/// Opens the file for reading alone, without locks and journals beside it, and without trust in what its schema makes SQLite do.
fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let flags =
        OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
    let connection = Connection::open_with_flags(immutable(path), flags)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MESSAGE_LIMIT)?;
    Ok(connection)
}

/// The file's URI, by which SQLite neither writes nor waits.
fn immutable(path: &Path) -> OsString {
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"/._-".contains(byte);
    let escape = |byte: u8| if plain(&byte) { char::from(byte).to_string() } else { format!("%{byte:02x}") };
    let path = path.as_os_str().as_bytes().iter().map(|byte| escape(*byte)).collect::<String>();
    OsString::from(format!("file:{path}?immutable=1"))
}
