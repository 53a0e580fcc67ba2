//! The settings in force: the settings from the parameters, with the live keep-outs of `~/keep_out`. Only this module gives settings
//! to the cycle. It builds the settings outside the cycle's thread.

use super::events::ParameterRecord;
use super::parameters::CYCLE_ENDED;
use super::ros_inputs::Request;
use dq_config::ServoParameters;
use dq_core::servo::Settings;
use dq_params::{ParameterStore, Value};
use dq_space::space::{KeepOut, MOST_KEEP_OUTS, Scene};
use dq_wire::ServoKind;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The settings that the cycle uses.
pub(super) struct InForce {
    now: Mutex<Current>,
    requests: Sender<Request>,
    kind: ServoKind,
}

struct Current {
    /// The settings without the keep-outs in `drawn`.
    settings: Settings,
    /// The number of keep-outs and keep-ins in the parameters, if the servo ignores them because constraints are off; otherwise 0.
    idle: usize,
    store: ParameterStore,
    drawn: Vec<KeepOut>,
    /// The text about keep-outs of `~/keep_out` that are not obeyed, or no longer move with their frames.
    refused: Option<String>,
    /// The scenes that the cycle may still use. A scene that the cycle has dropped is freed here, outside the cycle's thread.
    scenes: Vec<Arc<Scene>>,
}

/// The texts about keep-outs and keep-ins that are not obeyed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NotObeyed {
    /// The text about keep-outs and keep-ins that are not checked because constraints are off.
    pub idle: Option<String>,
    /// The text about refused keep-outs of `~/keep_out`.
    pub refused: Option<String>,
}

impl InForce {
    /// Creates the settings in force of a servo of this kind. The cycle already uses `settings`, which come from the parameters and
    /// have no keep-outs of `~/keep_out` yet. `idle` is the number of keep-outs and keep-ins in the parameters, if the servo ignores
    /// them; otherwise 0. `requests` sends later settings to the cycle.
    pub fn new(
        settings: Settings,
        idle: usize,
        store: ParameterStore,
        requests: Sender<Request>,
        kind: ServoKind,
    ) -> Self {
        let scenes = settings.scene.iter().cloned().collect();
        let now = Current { settings, idle, store, drawn: Vec::new(), refused: None, scenes };
        Self { now: Mutex::new(now), requests, kind }
    }

    /// Applies `parameters`. `store` has the same parameters. `changes` are the changes since the previous call, for the record.
    ///
    /// # Errors
    /// The reason why the parameters are refused.
    pub fn set(
        &self,
        parameters: ServoParameters,
        store: &ParameterStore,
        changes: &[(String, Value)],
    ) -> Result<(), String> {
        let now = &mut *self.lock();
        let ServoParameters { mut settings, idle_keep_outs, .. } = parameters;
        if settings.scene == now.settings.scene {
            settings.scene.clone_from(&now.settings.scene);
        }
        let asked = settings.keeping_out_of(&now.drawn).map_err(|why| why.to_string())?;
        let record = ParameterRecord::new(self.kind, store, changes, &now.drawn);
        self.ask(&mut now.scenes, asked, record)?;
        now.store.clone_from(store);
        (now.settings, now.idle) = (settings, idle_keep_outs);
        Ok(())
    }

    /// Returns whether the keep-outs of `~/keep_out` that are in force equal `drawn`.
    pub fn is_drawn(&self, drawn: &[KeepOut]) -> bool {
        self.lock().drawn == drawn
    }

    /// Replaces all keep-outs of `~/keep_out` by `drawn`.
    ///
    /// # Errors
    /// The reason why these keep-outs are refused.
    pub fn draw(&self, drawn: Vec<KeepOut>) -> Result<(), String> {
        let now = &mut *self.lock();
        let settings = now.settings.keeping_out_of(&drawn).map_err(|why| why.to_string())?;
        if settings.scene.is_some() {
            let record = ParameterRecord::new(self.kind, &now.store, &[], &drawn);
            self.ask(&mut now.scenes, settings, record)?;
        }
        now.drawn = drawn;
        Ok(())
    }

    /// Sends `settings` to the cycle. `record` has the parameters from which the settings were built. Adds the scene of `settings`
    /// to `scenes`, and frees the scenes that the cycle has dropped.
    fn ask(
        &self,
        scenes: &mut Vec<Arc<Scene>>,
        settings: Settings,
        record: ParameterRecord,
    ) -> Result<(), String> {
        scenes.retain(|scene| Arc::strong_count(scene) > 1);
        scenes.extend(settings.scene.clone());
        let request = Request::Configure(Box::new(settings), record);
        self.requests.send(request).map_err(|_| CYCLE_ENDED.to_owned())
    }

    /// Sets the text about the keep-outs of `~/keep_out` that are not obeyed.
    pub fn refuse(&self, refused: Option<String>) {
        self.lock().refused = refused;
    }

    /// Returns the largest number of keep-outs of `~/keep_out` that the servo can obey with the present parameters.
    pub fn room(&self) -> usize {
        let now = self.lock();
        now.settings.scene.as_ref().map_or(MOST_KEEP_OUTS.saturating_sub(now.idle), |scene| scene.room())
    }

    /// Returns how long to wait for the frame of a keep-out of `~/keep_out`: as long as for the frame of a goal.
    pub fn patience(&self) -> Duration {
        self.lock().settings.goal_frames.tf_timeout
    }

    /// Returns the texts about the keep-outs and keep-ins that are not obeyed.
    pub fn not_obeyed(&self) -> NotObeyed {
        let now = self.lock();
        let count = now.idle + if now.settings.scene.is_none() { now.drawn.len() } else { 0 };
        let idle = (count > 0).then(|| {
            format!("constraints is false: the arm ignores the {count} of keep_out, keep_in and ~/keep_out")
        });
        NotObeyed { idle, refused: now.refused.clone() }
    }

    fn lock(&self) -> MutexGuard<'_, Current> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_config::NodeParameters;
    use dq_params::ParameterOverride;
    use std::sync::mpsc::{Receiver, channel};

    fn store() -> ParameterStore {
        let keep_out = Value::StringArray(vec!["table half_space 0 0 1 -0.5".to_owned()]);
        let given = [("constraints", Value::Bool(true)), ("keep_out", keep_out)];
        let given = given.map(|(name, value)| ParameterOverride {
            name: name.to_owned(),
            value,
            source: "test".to_owned(),
            by_name: true,
        });
        ServoParameters::start("/dq_servo", given.into()).unwrap().0
    }

    fn drawn(count: usize) -> Vec<KeepOut> {
        (0..count).map(|i| format!("crate/{i} sphere 2 2 2 0.1").parse().unwrap()).collect()
    }

    /// Returns the names of the keep-outs in the settings that were last sent to the cycle. Returns `None` if no settings were sent
    /// since the last call, or if the last settings have no constraints.
    fn asked(inbox: &Receiver<Request>) -> Option<Vec<String>> {
        let Request::Configure(settings, _) = inbox.try_iter().last()? else { panic!() };
        let scene = settings.scene?;
        Some(scene.keep_outs().iter().map(|one| one.name.to_string()).collect())
    }

    fn new() -> (InForce, Receiver<Request>) {
        let (requests, inbox) = channel();
        let ServoParameters { settings, idle_keep_outs, .. } = ServoParameters::from_store(&store()).unwrap();
        (InForce::new(settings, idle_keep_outs, store(), requests, ServoKind::OneArm), inbox)
    }

    fn set(in_force: &InForce, changes: &[(&str, Value)]) -> Result<(), String> {
        let changes: Vec<_> =
            changes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        let store = store().with(&changes).unwrap();
        in_force.set(ServoParameters::from_store(&store).unwrap(), &store, &changes)
    }

    #[test]
    fn drawn_shapes_stay_when_parameters_are_set() {
        let (in_force, inbox) = new();
        in_force.draw(drawn(2)).unwrap();
        let all = ["table", "crate/0", "crate/1"];
        assert_eq!(asked(&inbox).unwrap(), all);
        // `param load` of an earlier dump sets all parameters in this way.
        let dump: Vec<_> = store().iter().map(|(declared, value)| (declared.name, value.clone())).collect();
        let dump: Vec<_> =
            dump.into_iter().filter(|(name, _)| *name == "keep_out" || *name == "controller").collect();
        set(&in_force, &dump).unwrap();
        assert_eq!(asked(&inbox).unwrap(), all);
        assert!(!store().iter().any(|(declared, _)| declared.name == "drawn"));
        in_force.draw(Vec::new()).unwrap();
        assert_eq!(asked(&inbox).unwrap(), all[..1]);
    }

    #[test]
    fn keep_outs_beyond_the_limit_are_refused_by_name_and_idle_ones_are_reported() {
        let (in_force, inbox) = new();
        assert_eq!((in_force.room(), in_force.not_obeyed()), (63, NotObeyed::default()));
        assert!(in_force.draw(drawn(64)).unwrap_err().ends_with("no room for crate/63"));
        in_force.draw(drawn(63)).unwrap();
        let more = ["a sphere 2 2 2 0.1", "b sphere 2 2 2 0.1"].map(str::to_owned).to_vec();
        let why = set(&in_force, &[("keep_out", Value::StringArray(more))]).unwrap_err();
        assert!(why.ends_with("no room for crate/62"), "{why}");
        assert_eq!(asked(&inbox).unwrap().len(), 64);
        set(&in_force, &[("constraints", Value::Bool(false))]).unwrap();
        assert_eq!(asked(&inbox), None);
        let idle = in_force.not_obeyed().idle.unwrap();
        assert!(idle.contains("constraints is false") && idle.contains("64"), "{idle}");
        in_force.draw(drawn(1)).unwrap();
        assert!(inbox.try_recv().is_err(), "the cycle has no part in it");
        set(&in_force, &[]).unwrap();
        assert_eq!(asked(&inbox).unwrap(), ["table", "crate/0"]);
    }

    #[test]
    fn a_scene_that_the_cycle_no_longer_uses_is_not_freed_by_the_cycle() {
        let (in_force, inbox) = new();
        let mut cycle = None;
        for count in 1..20 {
            in_force.draw(drawn(count)).unwrap();
            let Request::Configure(settings, _) = inbox.recv().unwrap() else { panic!() };
            if let Some(before) = std::mem::replace(&mut cycle, settings.scene) {
                assert!(Arc::strong_count(&before) > 1, "the cycle would free it");
            }
        }
        assert!(in_force.lock().scenes.len() <= 3);
    }
}
