//! Lets the search for another configuration run, on a thread of its own: the cycle waits for nobody.

use super::events::EventsRecord;
use dq_core::servo::{Arms, Event, STARTS, Search, Servo};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// So long a search may take: it is one of many things that the machine does.
const BUDGET: Duration = Duration::from_millis(20);

/// The cycle's end: one search, which is here or runs there, and comes and goes without an allocation.
pub(super) struct Searcher {
    here: Option<Box<Search>>,
    questions: SyncSender<Box<Search>>,
    answers: Receiver<Box<Search>>,
}

impl Searcher {
    /// For the servo of these arms.
    ///
    /// # Errors
    /// The operating system's, where it gives no thread.
    pub fn spawn(arms: Arms) -> std::io::Result<Self> {
        let (questions, asked) = sync_channel::<Box<Search>>(1);
        let (done, answers) = sync_channel(1);
        let search = move || {
            for mut search in asked {
                let end = Instant::now() + BUDGET;
                search.run(STARTS, || Instant::now() < end);
                if done.send(search).is_err() {
                    break;
                }
            }
        };
        std::thread::Builder::new().name("search".to_owned()).spawn(search)?;
        Ok(Self { here: Some(Box::new(Search::new(arms))), questions, answers })
    }

    /// Gives the servo what a search came to, and lets the next one run where it asks for that.
    pub fn feed(&mut self, servo: &mut Servo, record: &mut EventsRecord) {
        if let Ok(search) = self.answers.try_recv() {
            let _ = record.take(servo, Event::Found(search.found()));
            self.here = Some(search);
        }
        if let Some(search) = self.here.take_if(|search| servo.ask(search)) {
            // There is room for the only one. Where the thread has ended nobody answers, which the servo sees.
            let _ = self.questions.try_send(search);
        }
    }
}
